#!/usr/bin/env bash
# Fails on an #include that tests/layers.txt does not allow.
set -euo pipefail
cd "$(dirname "$0")/.."
table=tests/layers.txt
status=0
while IFS='|' read -r folder own foreign; do
  folder=$(echo "$folder" | xargs)
  case "$folder" in '' | '#'*) continue ;; esac
  [ -d "$folder" ] || continue
  while IFS=: read -r file line include; do
    name=$(sed -E 's/^[^"<]*["<]([^">]*)[">].*/\1/' <<<"$include")
    allowed=no
    if [[ $include == *'"'* ]]; then
      for place in $folder $own; do [[ $name == "$place"/* ]] && allowed=yes; done
    else
      case "$name" in
        */* | *.h | *.hpp) ;;
        *) allowed=yes ;;
      esac
      [[ $name == sys/* || $name == linux/* || $name == netinet/* || $name == arpa/* ]] && allowed=yes
      [[ $name =~ ^(unistd|fcntl|signal|poll|spawn|dirent|errno|netdb|pthread|pwd|termios|sched|time|stdlib|immintrin|emmintrin)\.h$ ]] && allowed=yes
      for library in $foreign; do
        [[ $name == "$library"* ]] && { [[ $file == *.cpp ]] || [[ $library == tl ]] || [[ $name == nlohmann/json_fwd.hpp ]]; } && allowed=yes
        [[ $library == stb && $name == stb_* && $file == *.cpp ]] && allowed=yes
      done
    fi
    [[ $allowed == yes ]] || { echo "$file:$line: $folder may not include $name"; status=1; }
  done < <(grep -rnE '^[[:space:]]*#[[:space:]]*include' "$folder" --include='*.h' --include='*.cpp' || true)
done <"$table"
exit $status
