#!/usr/bin/env bash
# A long session as on a device: a synthetic room through OpenNI2's own library and our driver, at 30 Hz in real time,
# tracked, mapped, labelled and recorded. Afterwards resident memory must have been flat to 1 % and every frame accounted
# for: frames_in = tracked + dropped + lost + rejected, and what was recorded + what the recorder dropped = frames_in.
#   toolchains/soak.sh [MINUTES, default 30] [FOLDER, default out/soak]
# Leaves resident.csv (seconds, kB), summary.json and report.html in FOLDER; the recording, some 15 GB in half an hour, goes.
set -euo pipefail
cd "$(dirname "$0")/.."
. toolchains/environment.sh

minutes=${1:-30} out=${2:-out/soak}
tactus=build/release/firmware_host/tactus
build release -- tactus tactus_openni2
[ -e build/release/openni2/OpenNI2/Drivers/libtactus_openni2.so.0 ] || { echo "soak.sh: OpenNI2 is not installed" >&2; exit 1; }
mkdir -p "$out"
rm -f "$out"/soak.tac "$out"/resident.csv

frames=$((minutes * 60 * 30))
echo "soak: $minutes minutes, $frames frames"
LD_LIBRARY_PATH=$PWD/build/release/openni2 TACTUS_OPENNI2_SOURCE="synthetic:bedroom?frames=300" \
  "$tactus" run openni2 --frames "0:$frames" --record "$out/soak.tac" --record-color jpeg --out "$out" >"$out/output.txt" 2>&1 &
program=$!
trap 'kill "$program" 2>/dev/null || true' EXIT
start=$SECONDS
while kill -0 "$program" 2>/dev/null; do
  resident=$(awk '/^VmRSS/{print $2}' "/proc/$program/status" 2>/dev/null || true)
  [ -z "$resident" ] || echo "$((SECONDS - start)),$resident" >>"$out/resident.csv"
  sleep 5
done
trap - EXIT
wait "$program" || { cat "$out/output.txt" >&2; echo "soak.sh: the session failed" >&2; exit 1; }
cat "$out/output.txt"

# Of summary.json, as it is written: one key a line, the first of its name.
value() { awk -F'[:,]' -v key="\"$1\"" '{ name = $1; gsub(/[ \t]/, "", name) } name == key { print $2 + 0; exit }' "$out/summary.json"; }
in=$(value frames_in) tracked=$(value frames_tracked) dropped=$(value frames_dropped) lost=$(value frames_lost)
rejected=$(value frames_rejected) missing=$(value frames_missing)
recorded=$("$tactus" info "$out/soak.tac" --quick --json | awk -F'[:,]' '/"frames"/ { print $2 + 0; exit }')
recorder_dropped=$(awk '/"recording"/ { inside = 1 } inside && /"dropped"/ { gsub(/[^0-9]/, ""); sum += $0 } inside && /^  }/ { exit } END { print sum + 0 }' "$out/summary.json")
# The first half minute is boot, the last seconds are the writing of outputs.
read -r least most < <(awk -F, -v last="$(tail -n 4 "$out/resident.csv" | head -n 1 | cut -d, -f1)" \
  '$1 >= 30 && $1 <= last { if (!n++ || $2 < least) least = $2; if ($2 > most) most = $2 } END { print least, most }' "$out/resident.csv")
echo "soak: in $in = tracked $tracked + dropped $dropped + lost $lost + rejected $rejected; never came $missing"
echo "soak: depth frames recorded $recorded, dropped by the recorder $recorder_dropped (both streams)"
echo "soak: resident $least to $most kB, $(awk -v a="$least" -v b="$most" 'BEGIN { printf "%.2f %%", 100 * (b - a) / a }')"
rm -f "$out/soak.tac"
failed=0
[ "$in" -eq $((tracked + dropped + lost + rejected)) ] || { echo "soak.sh: frames are unaccounted for" >&2; failed=1; }
[ "$recorder_dropped" -gt 0 ] || [ "$recorded" -eq "$in" ] || { echo "soak.sh: the recording lacks frames" >&2; failed=1; }
awk -v a="$least" -v b="$most" 'BEGIN { exit !(b <= a * 1.01) }' || { echo "soak.sh: memory grew" >&2; failed=1; }
exit $failed
