#!/bin/sh
# What is in pipeline/label/crf/fit.md: plays the synthetic office three times and the bedroom twice with the built-in
# network, fits the 3D CRF to the offices' cells, and makes the table of how sensitive the four metrics are to
# label::default_crf_parameters() on both rooms. The bedrooms take no part in the fit.
#
#   tests/bench/crf_fit.sh BUILD OUT     BUILD: a build folder with tactus and crf_fit; OUT: receives everything
#
# Half an hour on one quiet core.
set -eu
build=$(realpath "$1") out=$2
fit=$build/tests/bench/crf_fit
mkdir -p "$out"

cells() { # NAME SOURCE FRAMES
  "$build/firmware_host/tactus" eval labels "synthetic:$2" --model builtin --frames "$3" --every 6 \
    --save-points "$out/$1.points" > "$out/$1.txt"
}
cells office_1 'office?seed=1' 0:84
cells office_2 'office?seed=7' 150:234
cells office_3 'office?seed=3&noise=0' 80:164
cells bedroom_1 'bedroom?seed=1' 0:84
cells bedroom_2 'bedroom?seed=5' 150:234

cd "$out"
cat > start.toml << 'END'
preset = "default"
[smoothness]
weight = 1.0
theta_position_m = 0.08
[appearance]
weight = 2.0
theta_position_m = 0.2
theta_color = 20.0
[surface]
weight = 2.0
theta_position_m = 0.2
theta_normal = 0.6
END
rooms="office_1.points office_2.points office_3.points"
held_out="--held-out bedroom_1.points --held-out bedroom_2.points"
# Unquoted: one word a file.
"$fit" $rooms $held_out --from start.toml --fit 8 --out fit.toml | tee fit.txt
"$fit" $rooms $held_out --sensitivity sensitivity.md
cat sensitivity.md
