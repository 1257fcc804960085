#!/bin/sh
# manual_page.sh PROGRAM PAGE.gz: its manual page by help2man, with the help of each command and the settings as they are.
set -eu
program=$1
commands() { "$program" "$@" --help | sed -n '/^Subcommands:/,/^$/ s/^  \([a-z]\+\) .*/\1/p'; }
section() { printf '[%s]\n.nf\n' "$1"; sed -e 's/\\/\\e/g' -e 's/-/\\-/g' -e "s/^[.'\[\/]/\\\\\&&/"; printf '.fi\n'; }
more=$(mktemp)
trap 'rm -f "$more"' EXIT
for command in $(commands); do
  "$program" "$command" --help | section "$command"
  for below in $(commands "$command"); do
    "$program" "$command" "$below" --help | section "$command $below"
  done
done > "$more"
"$program" config | section settings >> "$more"
help2man --no-info --include="$more" --version-string="$("$program" --version)" \
  --name='RGB-D SLAM for rooms with people in them' "$program" | gzip -9n > "$2"
