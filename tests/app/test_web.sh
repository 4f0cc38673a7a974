#!/usr/bin/env bash
# mild web: the page's folder by Python's server, to this machine alone. Usage: test_web.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"

expect 0 'usage: mild web' "$mild" web --help
bad "--no-such" "$mild" web --no-such
bad "nowhere/index.html --folder" "$mild" web --folder nowhere
bad "--port" "$mild" web --port 70000
mkdir -p page http
echo page >page/index.html
head -c 50000 /dev/urandom >page/mild.wasm
bad "/none/python MILD_PYTHON" env MILD_PYTHON=/none/python "$mild" web --folder page
bad "--address" "$mild" web --folder page --address 192.0.2.1

# a module of the working directory is not run
echo 'open("ran", "w")' | tee runpy.py http/__init__.py >http/server.py
"$mild" web --port 0 --folder page >said 2>log &
server=$!
trap 'kill $server 2>/dev/null; rm -rf "$work"' EXIT
for _ in $(seq 200); do
    [ -s said ] && break
    sleep 0.1
done
port=$(sed -n 's|.*http://127.0.0.1:\([0-9]*\)/.*|\1|p' said)
[ -n "$port" ] || fail "no address in: $(cat said log)"
[ ! -e ran ] || fail "a file of the working directory was run"
(exec 3<>"/dev/tcp/127.0.0.2/$port") 2>/dev/null && fail "it listens at other addresses than 127.0.0.1"
bad "--port" "$mild" web --folder page --port "$port"

# gets STATUS PATH: the answer's head in `head`, the rest in `body`.
gets() {
    exec 3<>"/dev/tcp/127.0.0.1/$port" || fail "nobody listens"
    printf 'GET %s HTTP/1.0\r\n\r\n' "$2" >&3
    cat <&3 >answer
    exec 3>&-
    sed '/^\r$/q' answer >head
    tail -c +$(($(wc -c <head) + 1)) answer >body
    grep -q "^HTTP/1.[01] $1 " head || fail "no $1 for $2 but $(head -1 head)"
}
gets 200 '/?robot=g1'
cmp -s body page/index.html || fail "/ is not index.html"
gets 200 /mild.wasm
cmp -s body page/mild.wasm || fail "mild.wasm arrives changed"
grep -qi 'content-type: application/wasm' head || fail "the type of mild.wasm: $(cat head)" # the browser compiles while it loads
gets 404 /../said
finish "web: served"
