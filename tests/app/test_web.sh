#!/usr/bin/env bash
# mild web as a browser meets it, without one. Usage: test_web.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"

expect 0 'usage: mild web' "$mild" web --help
bad "--no-such" "$mild" web --no-such
bad "--folder" "$mild" web --folder nowhere
bad "--port" "$mild" web --port 70000
mkdir -p page folder/index.html link
touch {folder,link}/{mild.wasm,sa01.bin}
ln -s ../page/index.html link/index.html
bad "folder/index.html --folder" "$mild" web --folder folder
bad "link/index.html --folder" "$mild" web --folder link
for file in index.html style.css mild.js mild.wasm sa01.bin; do
    head -c 50000 /dev/urandom >page/$file
done
bad "192.0.2.1 --address" "$mild" web --folder page --address 192.0.2.1
bad "--address 127.0.0.1" "$mild" web --folder page --address localhost
echo secret >secret.html
ln -s ../secret.html page/link.html
mkdir page/folder.html

"$mild" web --port 0 --folder page >said &
server=$!
trap 'kill $server 2>/dev/null; rm -rf "$work"' EXIT
for _ in $(seq 100); do
    [ -s said ] && break
    sleep 0.1
done
port=$(sed -n 's|.*http://127.0.0.1:\([0-9]*\)/.*|\1|p' said)
[ -n "$port" ] || fail "no address in: $(cat said)"
(exec 3<>"/dev/tcp/127.0.0.2/$port") 2>/dev/null && fail "it listens at other addresses than 127.0.0.1"
bad "127.0.0.1 --port 0" "$mild" web --folder page --port "$port"

# ask REQUEST: the answer's head in `head`, the rest in `body`.
ask() {
    exec 3<>"/dev/tcp/127.0.0.1/$port" || fail "nobody listens"
    printf "$1" >&3
    cat <&3 >answer
    exec 3>&-
    sed '/^\r$/q' answer >head
    tail -c +$(($(wc -c <head) + 1)) answer >body
}
# gets STATUS REQUEST
gets() {
    ask "$2"
    grep -q "^HTTP/1.1 $1 " head || fail "no $1 for $2 but $(head -1 head)"
    [ "$1" = 200 ] || [ ! -s body ] || fail "something is sent for $2"
}

for file in index.html style.css mild.js mild.wasm sa01.bin; do
    gets 200 "GET /$file?query=1 HTTP/1.1\r\nHost: here\r\n\r\n"
    cmp -s body page/$file || fail "$file arrives changed"
done
grep -q 'Content-Length: 50000' head || fail "no length"
gets 200 'GET / HTTP/1.1\r\n\r\n'
cmp -s body page/index.html || fail "/ is not index.html"
grep -qi 'content-type: text/html' head || fail "no type"
gets 200 'HEAD /mild.wasm HTTP/1.1\r\n\r\n'
grep -q 'application/wasm' head && [ ! -s body ] || fail "HEAD"
for path in /secret.html /../secret.html /%2e%2e/secret.html '//secret.html' /link.html /folder.html /page/index.html /index \
    /.html /index.html/ /index.html.js '/\\..\\secret.html' /none.html; do
    gets 404 "GET $path HTTP/1.1\r\n\r\n"
done
for request in '\r\n\r\n' 'GET\r\n\r\n' 'GET index.html HTTP/1.1\r\n\r\n' 'GET /index.html\r\n\r\n' 'GET / SPDY/1.1\r\n\r\n'; do
    gets 400 "$request"
done
gets 405 'POST / HTTP/1.1\r\n\r\n'
gets 400 "$(printf 'x%.0s' $(seq 5000))"

# somebody who says nothing does not keep others waiting
exec 4<>"/dev/tcp/127.0.0.1/$port"
gets 200 'GET / HTTP/1.1\r\n\r\n'
exec 4>&-

# many who say one byte a second: others are answered 503, and are served when the time of those is over.
# A client counts until its thread has ended, so they begin when nobody is left; once more where a loaded machine opened
# them more slowly than they are dropped.
trap '' PIPE
slow=()
for _ in {1..5}; do
    for one in "${slow[@]}"; do exec {one}>&-; done
    slow=()
    for _ in {1..100}; do
        [ "$(ls "/proc/$server/task" | wc -l)" -gt 1 ] || break
        sleep 0.1
    done
    for _ in {1..64}; do
        exec {one}<>"/dev/tcp/127.0.0.1/$port" && slow+=("$one")
    done
    sleep 0.5
    ask 'GET / HTTP/1.1\r\n\r\n' 2>/dev/null # refused before it has spoken: a broken pipe
    grep -q '^HTTP/1.1 503 ' head && break
done
grep -q '^HTTP/1.1 503 ' head && grep -q '^Retry-After: ' head || fail "not refused in words: $(head -1 head)"
for _ in {1..8}; do
    for one in "${slow[@]}"; do printf G >&"$one"; done 2>/dev/null
    sleep 1
done
gets 200 'GET / HTTP/1.1\r\n\r\n'
late=0
for one in "${slow[@]}"; do
    read -r -t 1 line <&"$one" && [[ $line = 'HTTP/1.1 408 '* ]] && late=$((late + 1))
    exec {one}>&-
done 2>/dev/null
[ $late -ge 60 ] || fail "only $late of 64 are answered that their time is over"
memory=$(sed -n 's/^VmHWM:[[:space:]]*\([0-9]*\) kB/\1/p' /proc/$server/status) # [KiB]
[ -n "${ASAN_OPTIONS:-}" ] || [ "$memory" -lt 200000 ] || fail "the server took $memory KiB"
kill -0 $server || fail "the server has gone"
finish "web: served"
