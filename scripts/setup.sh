#!/usr/bin/env bash
# Sets a2v up: the Debian packages that the wheels need, .venv, the pinned dependencies. Run again, it does nothing.
#   PYTHON=python3.12 scripts/setup.sh    choose the interpreter (3.10 to 3.12)
# A line a step, with its share of the whole and its seconds; what pip, uv and apt print is in .a2v/setup.log.
set -euo pipefail
cd "$(dirname "$0")/.."
log=.a2v/setup.log

say() { printf 'setup: %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }

# step WORDS FROM TO COMMAND...: run the command with its output in the log; FROM and TO are the step's part of the whole, in percent.
# A terminal shows a line that changes; elsewhere a share is added to the line every ten seconds.
running=
step() {
  local words=$1 from=$2 to=$3 start=$SECONDS told=$SECONDS pause=10 share
  shift 3
  printf 'setup: %s' "$words" >&2
  set -m # a process group of its own, which `end` can kill as a whole
  "$@" >>"$log" 2>&1 </dev/null &
  running=$!
  set +m
  [ ! -t 2 ] || pause=1
  while kill -0 "$running" 2>/dev/null; do
    sleep 0.2
    [ $((SECONDS - told)) -ge "$pause" ] || continue
    told=$SECONDS
    share=$((from + (to - from) * $(fraction "$words" $((SECONDS - start))) / 100))
    if [ -t 2 ]; then printf '\rsetup: %s, %d %% of all, %d s ' "$words" "$share" "$((SECONDS - start))" >&2
    else printf ' %d%%' "$share" >&2; fi
  done
  if ! wait "$running"; then
    printf '\n' >&2
    grep -v '^ *$' "$log" | tail -n 4 >&2
    fail "$words failed; everything that was printed is in $PWD/$log"
  fi
  running=
  if [ -t 2 ]; then printf '\rsetup: %s, %d %% of all, %d s \n' "$words" "$to" "$((SECONDS - start))" >&2
  else printf ' %d%%, %d s\n' "$to" "$((SECONDS - start))" >&2; fi
}
# The percent of a step that is done: of the packages by what pip says and what lies in .venv, else by the seconds alone.
fraction() {
  local done=$((100 * $2 / ($2 + 60))) whole said there
  if [[ "$1" = packages* ]]; then
    whole=$(grep -c '==' constraints.txt)
    said=$(grep -c '^Collecting' "$log" || true)
    there=$(find .venv/lib/python*/site-packages -maxdepth 1 -name '*.dist-info' 2>/dev/null | wc -l)
    [ "$(((said + there) * 50 / whole))" -le "$done" ] || done=$(((said + there) * 50 / whole))
  fi
  echo $((done < 99 ? done : 99))
}
end() { [ -z "$running" ] || kill -- "-$running" 2>/dev/null || true; [ -z "${needed:-}" ] || rm -rf "$needed"; }
trap end EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

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
  mkdir -p .a2v && : >"$log"
  line="apt-get update && apt-get install -y --no-install-recommends ${missing[*]}"
  if ! command -v apt-get >/dev/null; then
    fail "this is no Debian or Ubuntu; install what holds these Debian packages' libraries, then run again: ${missing[*]}"
  elif [ "$(id -u)" = 0 ]; then
    step "system libraries (${missing[*]})" 0 3 env DEBIAN_FRONTEND=noninteractive bash -c "$line"
  elif command -v sudo >/dev/null && { [ -t 0 ] || sudo -n true 2>/dev/null; }; then
    sudo true # asks for the password, before the output goes to the log
    step "system libraries (${missing[*]}), with sudo" 0 3 sudo DEBIAN_FRONTEND=noninteractive bash -c "$line"
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

mkdir -p .a2v
: >"$log"
needed=$(mktemp -d)

if ! usable .venv/bin/python || ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
  [ ! -e .venv ] || { say ".venv does not work (moved, or another Python); making it anew"; rm -rf .venv; }
  step "Python environment .venv ($("$python" --version))" 3 6 "$python" -m venv .venv
fi
# --- every file that is installed has a hash in constraints.lock, or pip and uv refuse it.
pip=(.venv/bin/python -m pip install --disable-pip-version-check)
sed -n '/^pip==/,/[^\\]$/p' constraints.lock >"$needed/pip.txt"
step "pip" 6 8 "${pip[@]}" --require-hashes -r "$needed/pip.txt" # Debian 12's own pip (23.0) backtracks for many minutes

torch=$(sed -n 's/^torch==//p' constraints.txt)
.venv/bin/python scripts/requirements.py dev dask >"$needed/all.txt"
# uv unpacks in parallel. The lock has the hashes of torch's files on PyPI and of its CPU build for Python 3.11.
by_uv() {
  local uv=(uv pip install --python .venv/bin/python --require-hashes) cpu= folder
  for folder in ${PIP_FIND_LINKS:-}; do uv+=(--find-links "$folder"); done
  [ "$(uname -s)" = Darwin ] || cpu=+cpu
  sed "s/^torch==$torch /torch==$torch$cpu /" constraints.lock >"$needed/constraints.lock"
  .venv/bin/python scripts/requirements.py --locked dev dask | sed "s/^torch==$torch /torch==$torch$cpu /" >"$needed/locked.txt"
  sed -n '/^torch==/,/[^\\]$/p' "$needed/locked.txt" >"$needed/torch.txt"
  "${uv[@]}" --no-deps -r "$needed/torch.txt" ||
    "${uv[@]}" --no-deps -r "$needed/torch.txt" --index-url https://download.pytorch.org/whl/cpu || return 1
  "${uv[@]}" -c "$needed/constraints.lock" -r "$needed/locked.txt"
}
# torch first and by its exact CPU build: PyPI's build for Linux brings gigabytes of CUDA.
torch_by_pip() {
  ! .venv/bin/python -c "import importlib.metadata as m, sys; sys.exit(m.version('torch').split('+')[0] != '$torch')" || return 0
  # With --no-deps: what torch needs comes below, with the rest.
  local hashed=("${pip[@]}" --no-deps --require-hashes -c constraints.lock)
  if [ "$(uname -s)" = Darwin ]; then
    "${hashed[@]}" "torch==$torch"
  elif [ "$(uname -m)" = x86_64 ] && .venv/bin/python -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))'; then
    "${hashed[@]}" "torch==$torch+cpu" ||
      "${hashed[@]}" "torch==$torch+cpu" --extra-index-url https://download.pytorch.org/whl/cpu ||
      { say "found no CPU build of torch $torch that has a hash in constraints.lock; put its wheel in a folder and set PIP_FIND_LINKS to it"; return 1; }
  else
    say "constraints.lock has no hash of the CPU build of torch for $(.venv/bin/python --version) on $(uname -m): the index's own hash has to do"
    "${pip[@]}" --no-deps "torch==$torch+cpu" ||
      "${pip[@]}" --no-deps "torch==$torch+cpu" --extra-index-url https://download.pytorch.org/whl/cpu ||
      { say "found no CPU build of torch $torch for $(.venv/bin/python --version); see https://pytorch.org/get-started/locally, or put its wheel in a folder and set PIP_FIND_LINKS to it"; return 1; }
  fi
}
packages() {
  if command -v uv >/dev/null && by_uv; then return 0; fi
  torch_by_pip && "${pip[@]}" --require-hashes -c constraints.lock -r "$needed/all.txt"
}
itself() {
  "${pip[@]}" --no-deps --no-build-isolation -e . # a folder has no hash; setuptools is there by now
  .venv/bin/python -m pip check || true
}
compiled() { # what the first run would otherwise wait for: the body model, the matting
  .venv/bin/python -W ignore -m a2v.body.anny_data
  .venv/bin/python -W ignore -c 'import pymatting' || true
}
step "packages (about 4 GB unpacked)" 8 85 packages
step "a2v" 85 88 itself
step "the body model and the matting, compiled once" 88 100 compiled
fingerprint >"$stamp"
