#!/bin/bash
# What a robot waits for: pictures of a camera, 1280 x 640 JPEG at 30 a second, into `localise --add --update` with 10,000
# references on one core; three walks, of known places, of half unknown ones and of unknown ones. The camera is
# tests/support/v4l2_shim.cpp. Prints what `localise` says of each. The references take some minutes and are kept in FOLDER.
#   bench/live_run.sh BUILD FOLDER [WORDS OF localise ...]
set -euo pipefail
build=$(realpath "$1") folder=$2
shift 2
panonav=$build/bin/panonav
shim=$(find "$build" -name 'libv4l2_shim.so' | head -1)
sphere=(--kind panorama --elevation-low-deg -90 --elevation-high-deg 90 --quiet)
mkdir -p "$folder"
cd "$folder"

if [ ! -e references.panonav ]; then
  "$panonav" simulate hall references --grid 0.07 --rows 128 --columns 256 "${sphere[@]}"
  sed -i 's/"panorama"/"equirectangular"/; /elevation_deg/d' references/dataset.toml
  "$panonav" memorise references.panonav references --quiet
fi
for scene in hall office; do
  [ -e $scene ] && continue
  "$panonav" simulate $scene $scene --path walk --poses 300 --rows 640 --columns 1280 --seed 7 "${sphere[@]}"
  mkdir $scene/jpeg
  ffmpeg -v error -i $scene/view_%05d.png -q:v 3 -start_number 0 $scene/jpeg/%05d.jpg
done

# What the camera sends: each picture behind its length in four bytes.
pictures() {
  for jpeg in "$@"; do
    printf "$(stat -c %s "$jpeg" | awk '{printf "\\x%02x\\x%02x\\x%02x\\x%02x", $1 % 256, $1 / 256 % 256,
                                        $1 / 65536 % 256, $1 / 16777216}')"
    cat "$jpeg"
  done
}
pictures hall/jpeg/*.jpg > known
pictures hall/jpeg/000*.jpg office/jpeg/000*.jpg hall/jpeg/001*.jpg office/jpeg/001*.jpg > half
pictures office/jpeg/*.jpg > unknown

for walk in known half unknown; do
  cp references.panonav added.panonav
  echo "$walk:"
  V4L2_SHIM_PICTURES=$walk V4L2_SHIM_RATE=30 LD_PRELOAD=$shim taskset -c 0 "$panonav" localise added.panonav /dev/video7 \
    --add --update --count 900 --threads 1 "$@" > /dev/null
done
