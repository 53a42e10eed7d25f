#!/usr/bin/env bash
# An environment with Ray that sees the packages of .venv, which stays as it is:
#   scripts/make_ray_environment.sh FOLDER && FOLDER/bin/python -m pytest tests/pipelines/test_ray.py
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
"$here/.venv/bin/python" -m venv "$1"
site=$("$1/bin/python" -c "import sysconfig; print(sysconfig.get_path('purelib'))")
packages=$("$here/.venv/bin/python" -c "import sysconfig; print(sysconfig.get_path('purelib'))")
echo "import site; site.addsitedir('$packages')" > "$site/a2v-environment.pth"
"$1/bin/pip" install -q --no-deps -c "$here/constraints.txt" ray
