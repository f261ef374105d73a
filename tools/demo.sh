#!/usr/bin/env bash
# Start the node on a scene and the browser view of it; Ctrl-C ends both.  Usage: demo.sh VENV SCENE
set -uo pipefail

venv=$1
scene=$2
if [ ! -f "$scene" ]; then
    echo "cloth_ros: there is no scene '$scene'; ready ones are:" config/*.yaml >&2
    exit 1
fi
# Children of their own process groups: Ctrl-C reaches this script alone, which ends both in order.
set -m
children=()
stop() {
    trap '' INT TERM
    for child in "${children[@]}"; do
        kill -INT "$child" 2> /dev/null
    done
    wait
}
trap 'stop; exit 0' INT TERM HUP
"$venv/bin/cloth_node" --ros-args --params-file "$scene" &
children+=($!)
# The cloth comes first where both want the processor.
nice -n 5 "$venv/bin/cloth_viewer" ${PORT:+--port "$PORT"} &
children+=($!)
# Neither is of use without the other.  Waits are short, here on a pipe without data: bash would
# notice a signal that arrives just before one only at its end.
exec {nothing}<> <(:)
ended=
while [ -z "$ended" ]; do
    read -r -t 0.3 -u "$nothing"
    for child in "${children[@]}"; do
        kill -0 "$child" 2> /dev/null || ended=$child
    done
done
wait "$ended"
code=$?
stop
exit "$code"
