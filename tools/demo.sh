#!/usr/bin/env bash
# The main job on one sequence: demo.sh YGSLAM SEQUENCE|"" MODEL|"" OUT
set -euo pipefail
ygslam=$1 sequence=$2 model=$3 out=$4
shared=${YGSLAM_SHARED:-../shared}

if [ -z "$sequence" ]; then
  sequence=$shared/data/redkitchen_walk
  if [ ! -d "$sequence" ]; then
    sequence=out/rendered/walking_xyz
    if [ ! -f "$sequence/groundtruth.txt" ]; then
      echo "demo: no recording given (SEQ=folder): rendering people who walk through an office"
      "$ygslam" simulate walking_xyz --out "$sequence" --seconds 10 --truth
    fi
  fi
fi

if [ -z "$model" ]; then
  for candidate in models/yolov8n-seg_480x640_int8.xml models/yolov8n-seg_480x640.onnx \
                   "$shared/models/yolov8n-seg_480x640.onnx"; do
    if [ -f "$candidate" ]; then model=$candidate; break; fi
  done
fi
options=(--model "$model")
if [ -z "$model" ]; then
  echo "demo: people are found by the built-in network; a network that knows 80 classes: 'make model', MODEL=file.onnx"
  options=(--segmenter builtin)
fi

"$ygslam" run "$sequence" --out "$out" "${options[@]}" --debug-images "$out/images" --export "$out/scene"
"$ygslam" render "$out/scene" --path "$out/trajectory.txt" --boxes --out "$out/room.png" --quiet
.venv/bin/python tools/demo_picture.py --room "$out/room.png" --frames "$out/images" \
  --plan "$out/scene/grid.pgm" --out "$out/demo.png"
echo
echo "demo: open         $out/demo.png   (room, plan, what was seen; all files: docs/outputs.md)"
echo "demo: see it live  $ygslam run $sequence --out out/live --realtime --view"
