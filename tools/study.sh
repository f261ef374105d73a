#!/usr/bin/env bash
# Measure the figures of README and docs/.  Usage: study.sh VENV [options of cloth_tradeoff]
set -euo pipefail

venv=$1
shift
"$venv/bin/cloth_tradeoff" config/hanging.yaml config/gust.yaml config/drop_on_sphere.yaml \
    --out docs/tradeoff "$@"
"$venv/bin/cloth_tradeoff" config/small_fast_sphere.yaml --sphere 0 0 0.6 --over 0.3 \
    --out docs/tradeoff "$@"
"$venv/bin/python" -m tools.study_tables
