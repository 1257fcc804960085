#!/usr/bin/env bash
# count_lines.sh [COMMIT]: lines of source and of tests by folder, of the working tree or of a commit.
set -euo pipefail
cd "$(dirname "$0")/.."
commit=${1-}
kinds='\.(cpp|hpp|h|py|js|css|html|sh|cmake|frag|vert)$|(^|/)CMakeLists\.txt$|(^|/)Makefile$'
if [ -n "$commit" ]; then git ls-tree -r --name-only "$commit"; else git ls-files; fi | grep -E "$kinds" |
  while read -r file; do
    if [ -n "$commit" ]; then lines=$(git show "$commit:$file" | wc -l); else lines=$(wc -l < "$file"); fi
    echo "$file $lines"
  done |
  awk '{ top = $1 ~ /\// ? substr($1, 1, index($1, "/") - 1) : "."
         kind = $1 ~ /_test\.(cpp|hpp|py)$|^tests\/|\/testing\/|_test_[a-z]*\.(cpp|hpp)$|_testing\.hpp$|\/test_[a-z_]*\.hpp$|\/synthetic_[a-z_]*\.hpp$|\/referee\/|^fuzz\// ? "tests" : "source"
         n[kind, top] += $2; all[kind] += $2; tops[top] }
       END { for (kind in all) { for (top in tops) if ((kind, top) in n) printf "%-7s %-9s %6d\n", kind, top, n[kind, top]
                                 printf "%-7s %-9s %6d\n", kind, "all", all[kind] } }' | sort
