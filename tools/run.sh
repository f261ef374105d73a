#!/usr/bin/env bash
# Print how to command a scene, and start the node on it.  Usage: run.sh VENV SCENE
set -euo pipefail

venv=$1
scene=$2
if [ ! -f "$scene" ]; then
    echo "cloth_ros: there is no scene '$scene'; ready ones are:" config/*.yaml >&2
    exit 1
fi
"$venv/bin/python" -m tools.usage "$venv/bin/python" "$scene"
exec "$venv/bin/cloth_node" --ros-args --params-file "$scene"
