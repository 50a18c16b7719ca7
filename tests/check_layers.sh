#!/usr/bin/env bash
# Fails on an #include that tests/layers.txt does not allow.
set -euo pipefail
cd "$(dirname "$0")/.."

# The table first, then "file:line:include" of every include; a file belongs to the longest folder of the table.
find core server client_cli web_viewer -path web_viewer/node_modules -prune -o \( -name '*.h' -o -name '*.cpp' \) -print0 |
  sort -z | xargs -0 grep -nHE '^[[:space:]]*#[[:space:]]*include' |
  awk -v table=tests/layers.txt '
    BEGIN {
      while ((getline row < table) > 0) {
        if (row ~ /^#/ || split(row, part, "|") < 3) continue
        gsub(/ /, "", part[1])
        own[part[1]] = part[1] " " part[2]
        foreign[part[1]] = part[3]
      }
    }
    function folder_of(file,    best, f) {
      for (f in own) if (index(file, f "/") == 1 && length(f) > length(best)) best = f
      return best
    }
    function of_ours(folder, name,    place, i, n) {
      n = split(own[folder], place, " ")
      for (i = 1; i <= n; ++i) if (index(name, place[i] "/") == 1) return 1
      return 0
    }
    function of_the_system(name) {
      if (name !~ /\// && name !~ /\.h(pp)?$/) return 1
      if (name ~ /^(sys|linux|netinet|arpa)\//) return 1
      return name ~ /^(unistd|fcntl|signal|poll|spawn|dirent|errno|netdb|pwd|termios|sched|time|stdlib|malloc|pthread|immintrin|emmintrin)\.h$/
    }
    function of_a_library(folder, name, file,    library, i, n) {
      n = split(foreign[folder], library, " ")
      for (i = 1; i <= n; ++i) {
        if (index(name, library[i]) != 1) continue
        if (file ~ /\.cpp$/ || library[i] == "tl" || name == "nlohmann/json_fwd.hpp") return 1
      }
      return 0
    }
    {
      split($0, place, ":")
      folder = folder_of(place[1])
      if (folder == "") next
      name = $0
      quoted = name ~ /include[[:space:]]*"/
      sub(/^[^"<]*["<]/, "", name)
      sub(/[">].*$/, "", name)
      fine = quoted ? of_ours(folder, name) : of_the_system(name) || of_a_library(folder, name, place[1])
      if (!fine) { print place[1] ":" place[2] ": " folder " may not include " name; bad = 1 }
    }
    END { exit bad }'
