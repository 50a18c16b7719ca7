#!/usr/bin/env bash
# Every header of ours compiles alone.   check_headers.sh COMPILER
# The build has shown it of a header that its own .cpp includes before anything else; the others are compiled here.
set -euo pipefail
cd "$(dirname "$0")/.."
compiler=${1:-g++}
export compiler
compile_alone() {
  local own=${1%.h}.cpp
  [ ! -f "$own" ] || [ "$(grep -m 1 '^#include' "$own")" != "#include \"$1\"" ] || return 0
  "$compiler" -std=c++20 -fsyntax-only -I. -x c++ - <<<"#include \"$1\"" || { echo "does not compile alone: $1"; return 1; }
}
export -f compile_alone
find core server client_cli web_viewer \( -name node_modules -o -name dist \) -prune -o -name '*.h' -print0 |
  xargs -0 -P "$(nproc)" -I{} bash -c 'compile_alone {}'
