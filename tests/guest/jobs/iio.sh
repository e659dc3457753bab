# An accelerometer's driver on a simulated chip.
. "$root/tests/guest/jobs/common.sh"

need iio/guest_iio_test
load -a i2c-dev mma7660 && load i2c-stub chip_addr=0x4c || exit 1
run_tests iio/guest_iio_test
