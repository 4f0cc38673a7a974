#!/usr/bin/env bash
# One version: CMakeLists.txt, CITATION.cff and CHANGELOG.md agree, the Python package takes it from the first, and the program's version follows commit and tag as
# cmake/Version.cmake says. Usage: test_version.sh SOURCE_FOLDER
source "$(dirname "$0")/../kit.sh" "$1"
source=$mild # no program here

version=$(sed -n 's/^project(mild VERSION \([0-9.]*\) .*/\1/p' "$source/CMakeLists.txt")
[[ $version =~ ^[0-9]+\.[0-9]+\.[0-9]+$ ]] || fail "version of CMakeLists.txt: '$version'"
[ "$(sed -n 's/^version: //p' "$source/CITATION.cff")" = "$version" ] || fail "CITATION.cff does not say $version"
[ "$(sed -n 's/^## \[\([0-9.]*\)\].*/\1/p' "$source/CHANGELOG.md" | head -1)" = "$version" ] ||
    fail "the newest version in CHANGELOG.md is not $version"

# What pip and `mild.__version__` say comes from CMakeLists.txt (tests/python/test_spec.py asks the package).
python3 - "$source" <<'END' >package || fail "pyproject.toml: $(cat package)"
import pathlib, re, sys, tomllib
source = pathlib.Path(sys.argv[1])
table = tomllib.loads((source / "pyproject.toml").read_text())
assert "version" not in table["project"] and table["project"]["dynamic"] == ["version"], "a version of its own"
said = table["tool"]["scikit-build"]["metadata"]["version"]
print(re.search(said["regex"], (source / said["input"]).read_text())["value"])
# One name on the package index, which is not `mild`, another project's.
name = table["project"]["name"]
cuda = tomllib.loads((source / "python/cuda/pyproject.toml").read_text())["project"]
assert cuda["name"] == name + "-cuda" and cuda["dependencies"][0] == name, cuda
for file in [*source.glob("docs/**/*.md"), *source.glob("python/mild/*.py"), *source.glob("examples/**/*.py"), source / "README.md"]:
    wrong = re.search(r"(pip install |dist/)'?mild(_cuda)?(-|\[| *$)", file.read_text(), re.MULTILINE)
    assert not wrong, f"{file} names a package '{wrong[0]}', but it is {name}"
END
[ "$(cat package)" = "$version" ] || fail "pyproject.toml finds $(cat package), not $version"

# says PATTERN: what the header says of the folder `tree`.
says() {
    rm -f header.h
    cmake -DSOURCE="$work/tree" -DBASE=1.2.3 -DHEADER="$work/header.h" -P "$source/cmake/Version.cmake" 2>errors
    grep -qE "^#define MILD_VERSION \"$1\"\$" header.h || fail "not $1 but $(cat header.h errors)"
}
git() {
    GIT_CONFIG_GLOBAL=/dev/null command git -C tree -c user.name=a -c user.email=a@b "$@" >/dev/null || fail "git $*"
}

mkdir tree
GIT_CEILING_DIRECTORIES=$work says '1\.2\.3' # no repository
command git init -q tree
echo one >tree/file
git add file
git commit -qm one
says '1\.2\.3\+g[0-9a-f]{9,}'
git tag checkpoint-v9
says '1\.2\.3\+g[0-9a-f]{9,}'
git tag v1.2.3
says '1\.2\.3'
echo two >tree/file
says '1\.2\.3\+g[0-9a-f]{9,}\.dirty'
git commit -qam two
says '1\.2\.3\+g[0-9a-f]{9,}'
git tag v1.3.0
cmake -DSOURCE="$work/tree" -DBASE=1.2.3 -DHEADER="$work/header.h" -P "$source/cmake/Version.cmake" 2>errors &&
    fail "a wrong tag is not an error"
tr -s ' \n' ' ' <errors | grep -q 'the tag v1.3.0, but CMakeLists.txt says VERSION 1.2.3: change one' || fail "$(cat errors)"

finish "version $version; commit and tag decide the rest"
