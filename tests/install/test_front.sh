#!/usr/bin/env bash
# The front door: a README that is read in 20 seconds, whose code compiles; an index that names every page; links that lead somewhere;
# drawings that are the tree.
# Usage: test_front.sh SOURCE_FOLDER
source "$(dirname "$0")/../kit.sh" "$1"
source=$mild # no program here

lines=$(wc -l <"$source/README.md") words=$(wc -w <"$source/README.md")
[ "$lines" -le 90 ] || fail "README.md has $lines lines, more than 90: tables go to docs/results.md"
[ "$words" -le 600 ] || fail "README.md has $words words, more than 600"
bytes=$(stat -c %s "$source/docs/walk.webp")
[ "$bytes" -lt 4000000 ] || fail "docs/walk.webp has $bytes bytes: a page that is slow to load"
for page in "$source"/docs/*.md; do
    name=$(basename "$page")
    [ "$name" = README.md ] || grep -q "($name" "$source/docs/README.md" || fail "docs/README.md does not name $name"
done
for folder in "$source"/src/*/; do
    grep -q "^| \`$(basename "$folder")\` |" "$source/src/README.md" || fail "src/README.md has no sentence for $folder"
done

sed -n '/^```c$/,/^```$/{/^```/d;p}' "$source/README.md" >front.c
[ -s front.c ] || fail "README.md has no block of C"
"${CC:-cc}" -std=c17 -Wall -Wextra -Wconversion -Werror -I"$source/include" -fsyntax-only front.c || fail "the C of README.md"
sed -n '/^```python$/,/^```$/{/^```/d;p}' "$source/README.md" >front.py
python3 -c 'compile(open("front.py").read(), "README.md", "exec")' || fail "the Python of README.md"
grep -q 'mild.attach(spec, feet=\[.*ground=' front.py && grep -q 'def attach(spec, feet=(), ground=' "$source/python/mild/spec.py" ||
    fail "README.md calls mild.attach in a way that python/mild/spec.py does not have"

grep -ho '`make [a-z]* && build/mild' "$source"/README.md "$source"/docs/*.md | cut -d' ' -f2 | sort -u >targets
for target in $(cat targets); do # what a page runs next must be there
    make -s -n -C "$source" "$target" | grep -q 'cmake --build build .*--target mild$' || fail "make $target does not build build/mild"
done
[ -s targets ] || fail "no page runs build/mild after a target of make"

python3 "$source/scripts/links.py" || fail "links of the tree"

mkdir -p linked/scripts linked/docs linked2
cp "$source/scripts/links.py" linked/scripts/
cat >linked/docs/page.md <<'END'
# One `two`: three
## Again
## Again
```
# no heading, [no link](nowhere.md)
```
Fine: [a](page.md), [b](#one-two-three), [c](../scripts/links.py), [d](page.md#again-1), [e](../docs), [f](https://nowhere.example/x),
`[code](nowhere.md)`.

    [indented](nowhere.md)

[gone](gone.md), [a link over
two lines](../gone.png) ![picture](gone.png) [anchor](#four), [other](page.md#no-heading-no-link) [out](../../linked2)
END
python3 linked/scripts/links.py >said 2>/dev/null && fail "faults, but exit 0"
cat >wanted <<'END'
docs/page.md:12: gone.md: there is no gone.md
docs/page.md:12: ../gone.png: there is no ../gone.png
docs/page.md:13: gone.png: there is no gone.png
docs/page.md:13: #four: no heading of page.md has this anchor
docs/page.md:13: page.md#no-heading-no-link: no heading of page.md has this anchor
docs/page.md:13: ../../linked2: outside the tree
END
diff wanted said || fail "the check does not say what is wrong"

python3 "$source/scripts/drawings.py" --check || fail "drawings"
mkdir -p tree/docs tree/scripts
cp "$source/scripts/drawings.py" tree/scripts/
cp "$source"/docs/*.svg tree/docs/
cp -r "$source/src" tree/src
sees() {
    python3 tree/scripts/drawings.py --check 2>said && fail "the check does not see: $1"
    grep -q "$1" said || fail "the check says $(cat said) of: $1"
}
echo '#include "view/view.h"' >>tree/src/control/controller.h
sees 'house.svg is not what src is'
mkdir tree/src/attic
sees 'attic: a folder of src without a row'
finish "README.md: $lines lines, $words words; $(ls "$source"/docs/*.md | wc -l) pages"
