#!/usr/bin/env bash
# Every C++ file is as clang-format would have it.
set -euo pipefail
cd "$(dirname "$0")/.."
command -v clang-format >/dev/null || { echo "skipped: clang-format is not installed"; exit 77; }
find core server client_cli tests web_viewer \( -name node_modules -o -name dist \) -prune -o \( -name '*.cpp' -o -name '*.h' \) -print0 |
  xargs -0 clang-format --dry-run --Werror
