#!/usr/bin/env bash
# From a clone on Debian 12 to a report: installs what is missing, builds, runs the built-in synthetic bedroom.
set -euo pipefail
cd "$(dirname "$0")/.."
. toolchains/packages.sh
. toolchains/environment.sh

install_packages "${packages_run[@]}"
echo "build: preset release, $jobs jobs (some minutes the first time)"
build release -DTACTUS_BUILD_TESTS=OFF -- tactus
echo "run: build/release/firmware_host/tactus run synthetic:bedroom --out out/bedroom"
build/release/firmware_host/tactus run synthetic:bedroom --out out/bedroom
echo
echo "Open this in a browser: $PWD/out/bedroom/report.html"
