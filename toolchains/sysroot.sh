#!/usr/bin/env bash
# Makes the arm64 root that the cross build compiles against and qemu loads libraries from: Debian packages, unpacked
# and not installed. Kept in the cache and made again only when the package list changes. Needs packages_cross.
set -euo pipefail
cd "$(dirname "$0")/.."
. toolchains/packages.sh
. toolchains/environment.sh

wanted="bookworm arm64 ${packages_sysroot[*]}"
stamp=$TACTUS_SYSROOT/tactus-sysroot
if [ "$(cat "$stamp" 2>/dev/null)" = "$wanted" ]; then
  echo "sysroot: $TACTUS_SYSROOT is up to date"
  exit 0
fi

echo "sysroot: making $TACTUS_SYSROOT (about a minute, 500 MB)"
fresh=$TACTUS_SYSROOT.fresh
rm -rf "$fresh"
mkdir -p "$fresh"

# The machine's own way to the Debian archive: its mirror and proxy settings, whatever they are.
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Component: main' \
  "Codename: bookworm" 2>/dev/null | head -n 1)
apt_options=()
while IFS= read -r line; do
  apt_options+=(--aptopt="$line")
done < <(apt-config dump --no-empty Acquire::http Acquire::https Acquire::Check-Valid-Until Acquire::Retries)

# As a tar stream, so that files belong to the caller and device nodes are left out.
mmdebstrap --quiet --variant=extract --architectures=arm64 --include="$(IFS=,; echo "${packages_sysroot[*]}")" \
  --aptopt='APT::Install-Recommends "false"' "${apt_options[@]}" bookworm - \
  "deb ${mirror:-http://deb.debian.org/debian/} bookworm main" |
  tar -x -C "$fresh" --no-same-owner --exclude='./dev/*' --exclude='./usr/share/doc/*' --exclude='./usr/share/locale/*'

# Links must stay inside: absolute ones would lead into the host.
find "$fresh" -type l -lname '/*' -print0 | while IFS= read -r -d '' link; do
  ln -sfnr "$fresh$(readlink "$link")" "$link"
done
# What update-alternatives would do on installation; OpenCV's image codecs load both at run time.
lib=usr/lib/aarch64-linux-gnu
ln -sfn blas/libblas.so.3 "$fresh/$lib/libblas.so.3"
ln -sfn lapack/liblapack.so.3 "$fresh/$lib/liblapack.so.3"

echo "$wanted" >"$fresh/tactus-sysroot"
rm -rf "$TACTUS_SYSROOT"
mv "$fresh" "$TACTUS_SYSROOT"
