#!/usr/bin/env bash
# Make the virtual environment.  Usage: environment.sh VENV PURPOSE-ROS
#   PURPOSE  run, viewer for `make demo`, or test for the tools of `make test` as well
#   ROS      wheels: ROS 2 Jazzy from wheels; sourced: the one that is sourced
set -euo pipefail

venv=$1
purpose=${2%-*}
ros=${2#*-}

fail() {
    echo "cloth_ros: $1" >&2
    exit 1
}

# The first of these that is a Python with wheels of ROS 2 Jazzy; PYTHON names another.
# With ROS 2 sourced, python3 is the one its rclpy was built for.
candidates=${PYTHON:-python3 python3.12 python3.13 python3.11 python3.10}
[ "$ros" = wheels ] || candidates=${PYTHON:-python3}
python=
for candidate in $candidates; do
    if "$candidate" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' \
        2> /dev/null; then
        python=$candidate
        break
    fi
done
[ -n "$python" ] || fail "needs Python 3.10 to 3.13, and none of these is one: $candidates; install one, or name it: make PYTHON=…"
"$python" -c 'import ensurepip, venv' 2> /dev/null \
    || fail "$python cannot make virtual environments; install its venv package (Debian, Ubuntu: apt install python3-venv)"

extras=tradeoff,record
[ "$purpose" = run ] || extras+=,$purpose
# Tests try the browser view, too.
[ "$purpose" != test ] || extras+=,viewer
options=
if [ "$ros" = wheels ]; then
    [ "$(uname -sm)" = 'Linux x86_64' ] \
        || fail "the wheels of ROS 2 are for Linux on x86_64, this is $(uname -sm); source a ROS 2 Jazzy installation instead"
    extras=ros,$extras
else
    "$python" -c 'import rclpy' 2> /dev/null \
        || fail "ROS 2 is sourced, but $python has no rclpy; install ros-$ROS_DISTRO-rclpy, or name its Python: make PYTHON=…"
    options=--system-site-packages
fi

# One kind of ROS after the other in one environment would mix them.
if ! ls "$venv"/.ready-*-"$ros" > /dev/null 2>&1 || ! "$venv/bin/python" -c '' 2> /dev/null; then
    rm -rf "$venv"
fi
echo "cloth_ros: preparing the environment in $venv for make $purpose; the first time takes about a minute"
[ -d "$venv" ] || "$python" -m venv $options "$venv"
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    --editable ".[$extras]" \
    || fail 'pip could not install what is needed, see above; is there a network?'
touch "$venv/.ready-$2"
