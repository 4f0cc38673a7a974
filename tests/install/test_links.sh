#!/usr/bin/env bash
# Every relative link of our Markdown leads somewhere, and the check sees one that does not. Usage: test_links.sh SOURCE_FOLDER
source "$(dirname "$0")/../kit.sh" "$1"
source=$mild # no program here

python3 "$source/scripts/links.py" || fail "links of the tree"

mkdir -p "$work/tree/scripts" "$work/tree/docs"
cp "$source/scripts/links.py" "$work/tree/scripts/"
cat >"$work/tree/docs/page.md" <<'END'
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
two lines](../gone.png) ![picture](gone.png) [anchor](#four), [other](page.md#no-heading-no-link) [out](../../tree2)
END
mkdir "$work/tree2"
python3 "$work/tree/scripts/links.py" >"$work/said" 2>/dev/null && fail "faults, but exit 0"
cat >"$work/wanted" <<'END'
docs/page.md:12: gone.md: there is no gone.md
docs/page.md:12: ../gone.png: there is no ../gone.png
docs/page.md:13: gone.png: there is no gone.png
docs/page.md:13: #four: no heading of page.md has this anchor
docs/page.md:13: page.md#no-heading-no-link: no heading of page.md has this anchor
docs/page.md:13: ../../tree2: outside the tree
END
diff "$work/wanted" "$work/said" || fail "the check does not say what is wrong"
finish "links lead somewhere"
