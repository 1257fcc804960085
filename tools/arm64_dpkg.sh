#!/usr/bin/env bash
# arm64_dpkg.sh UNPACKED ROOT: a hook of mmdebstrap for tools/arm64_root.sh. Writes dpkg's records of the packages with
# libraries, as if they were installed in ROOT on this machine: dpkg-shlibdeps reads there what the program's package needs.
set -euo pipefail
records=$1/var/lib/dpkg
control=$(mktemp -d)
trap 'rm -rf "$control"' EXIT
echo 1 > "$records/info/format"
for deb in "$1"/var/cache/apt/archives/*.deb; do
  rm -rf "${control:?}"/*
  dpkg-deb -e "$deb" "$control"
  [ -e "$control/shlibs" ] || continue
  name=$(dpkg-deb -f "$deb" Package)
  if grep -q '^Multi-Arch: same' "$control/control"; then name+=:arm64; fi
  sed '1a Status: install ok installed' "$control/control" >> "$records/status"
  echo >> "$records/status"
  for file in shlibs symbols; do
    if [ -e "$control/$file" ]; then cp "$control/$file" "$records/info/$name.$file"; fi
  done
  # Debian 12 has /lib as a link to /usr/lib, its packages have not.
  dpkg-deb --fsys-tarfile "$deb" | tar -t | sed -E "s|/\$||; s|^\\.(/lib)?|$2\\1|; p; s|^$2/lib/|$2/usr/lib/|" |
    sort -u > "$records/info/$name.list"
done
