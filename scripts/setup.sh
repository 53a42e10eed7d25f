#!/usr/bin/env bash
# Sets a2v up: the Debian packages that the wheels need, .venv, the pinned dependencies. Run again, it does nothing.
#   PYTHON=python3.12 scripts/setup.sh    choose the interpreter (3.10 to 3.12)
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf 'setup: %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }

# A stamp inside .venv names what was installed and where (a moved .venv is broken).
fingerprint() { { cat pyproject.toml constraints.txt scripts/setup.sh; pwd; } | sha256sum | cut -d' ' -f1; }
stamp=.venv/.a2v-setup

# --- libraries of the system: the name that the loader looks for, then the Debian package
libraries='libusb-1.0.so.0 libusb-1.0-0
libGL.so.1 libgl1
libEGL.so.1 libegl1
libX11.so.6 libx11-6
libgthread-2.0.so.0 libglib2.0-0
libSM.so.6 libsm6
libXext.so.6 libxext6
libOpenGL.so.0 libopengl0
libatomic.so.1 libatomic1'
missing=()
if [ "$(uname -s)" = Linux ]; then
  known=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null || true)
  while read -r soname package; do
    case "$known" in *"$soname "*) ;; *) missing+=("$package") ;; esac
  done <<<"$libraries"
fi

# --- Python 3.10 to 3.12
usable() { "$1" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 12))' 2>/dev/null; }
if [ -n "${PYTHON:-}" ]; then
  usable "$PYTHON" || fail "PYTHON=$PYTHON is not a Python from 3.10 to 3.12"
  python=$PYTHON
else
  python=
  for candidate in python3.11 python3.12 python3.10 python3; do
    if command -v "$candidate" >/dev/null && usable "$candidate"; then python=$candidate; break; fi
  done
fi
if [ -z "$python" ]; then
  missing+=(python3 python3-venv)
elif ! usable .venv/bin/python && ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
  missing+=("$("$python" -c 'import sys; print(f"python3.{sys.version_info[1]}-venv")')")
fi

if [ ${#missing[@]} -gt 0 ]; then
  line="apt-get update && apt-get install -y --no-install-recommends ${missing[*]}"
  if ! command -v apt-get >/dev/null; then
    fail "this is no Debian or Ubuntu; install what holds these Debian packages' libraries, then run again: ${missing[*]}"
  elif [ "$(id -u)" = 0 ]; then
    say "installing ${missing[*]}"
    DEBIAN_FRONTEND=noninteractive bash -c "$line" >&2 || fail "apt-get failed; run: $line"
  elif command -v sudo >/dev/null && { [ -t 0 ] || sudo -n true 2>/dev/null; }; then
    say "installing ${missing[*]} with sudo"
    sudo DEBIAN_FRONTEND=noninteractive bash -c "$line" >&2 || fail "apt-get failed; run: sudo sh -c '$line'"
  else
    fail "paste this line as root, then run again:  $line"
  fi
  [ -n "$python" ] || python=python3
  usable "$python" || fail "no Python from 3.10 to 3.12 here; install one and name it: make PYTHON=/path/to/python3.12"
fi

[ "$(cat "$stamp" 2>/dev/null)" != "$(fingerprint)" ] || exit 0

# One installation at a time.
if command -v flock >/dev/null; then
  mkdir -p .a2v
  exec 9>.a2v/setup.lock
  flock 9
  [ "$(cat "$stamp" 2>/dev/null)" != "$(fingerprint)" ] || exit 0
fi

if ! usable .venv/bin/python || ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
  [ ! -e .venv ] || { say ".venv does not work (moved, or another Python); making it anew"; rm -rf .venv; }
  say "making .venv with $("$python" --version)"
  "$python" -m venv .venv
fi
# --- every file that is installed has a hash in constraints.lock, or pip refuses it.
pip=(.venv/bin/python -m pip install --disable-pip-version-check)
needed=$(mktemp -d)
trap 'rm -rf "$needed"' EXIT
sed -n '/^pip==/,/[^\\]$/p' constraints.lock >"$needed/pip.txt"
"${pip[@]}" -q --require-hashes -r "$needed/pip.txt" # Debian 12's own pip (23.0) backtracks for many minutes

# --- torch first and by its exact CPU build: PyPI's build for Linux brings gigabytes of CUDA.
torch=$(sed -n 's/^torch==//p' constraints.txt)
if ! .venv/bin/python -c "import importlib.metadata as m, sys; sys.exit(m.version('torch').split('+')[0] != '$torch')" 2>/dev/null; then
  say "installing torch $torch for the CPU"
  # With --no-deps: what torch needs comes below, with the rest. The lock has the hashes of PyPI's files and of the CPU build for Python 3.11.
  hashed=("${pip[@]}" --no-deps --require-hashes -c constraints.lock)
  if [ "$(uname -s)" = Darwin ]; then
    "${hashed[@]}" "torch==$torch"
  elif [ "$(uname -m)" = x86_64 ] && .venv/bin/python -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))'; then
    "${hashed[@]}" "torch==$torch+cpu" 2>/dev/null ||
      "${hashed[@]}" "torch==$torch+cpu" --extra-index-url https://download.pytorch.org/whl/cpu ||
      fail "found no CPU build of torch $torch that has a hash in constraints.lock; put its wheel in a folder and set PIP_FIND_LINKS to it"
  else
    say "constraints.lock has no hash of the CPU build of torch for $(.venv/bin/python --version) on $(uname -m): the index's own hash has to do"
    "${pip[@]}" --no-deps "torch==$torch+cpu" 2>/dev/null ||
      "${pip[@]}" --no-deps "torch==$torch+cpu" --extra-index-url https://download.pytorch.org/whl/cpu ||
      fail "found no CPU build of torch $torch for $(.venv/bin/python --version); see https://pytorch.org/get-started/locally, or put its wheel in a folder and set PIP_FIND_LINKS to it"
  fi
fi

say "installing the pinned dependencies (about 4 GB unpacked; some minutes the first time)"
.venv/bin/python scripts/requirements.py dev dask >"$needed/all.txt"
"${pip[@]}" --require-hashes -c constraints.lock -r "$needed/all.txt" | { grep -v '^Requirement already satisfied' || true; }
"${pip[@]}" -q --no-deps --no-build-isolation -e . # a folder has no hash; setuptools is there by now
.venv/bin/python -m pip check >/dev/null || say "pip check is not clean: $(.venv/bin/python -m pip check | head -n 3)"
say "compiling once what the first run would otherwise wait for: the body model, the matting"
.venv/bin/python -W ignore -m a2v.body.anny_data >&2
.venv/bin/python -W ignore -c 'import pymatting' || say "pymatting did not compile ahead; the first run will do it"
fingerprint >"$stamp"
say "done"
