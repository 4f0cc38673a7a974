#!/usr/bin/env bash
# The man page and the completion: all that --help lists, and what the completion offers at a place. Usage: test_completion.sh MILD
source "$(dirname "$0")/../kit.sh" "$1"

"$mild" info man >mild.1 || fail "info man"
"$mild" info completion >completion || fail "info completion"
source ./completion
compopt() { nospace=$2; } # the shell's own works in a completion only

# offered WORD...: what is offered for the last word, on one line.
offered() {
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
    _mild
    echo "${COMPREPLY[*]}"
}
offers() {
    local wanted=$1
    shift
    [ "$(offered "$@")" = "$wanted" ] || fail "completion of '$*': '$(offered "$@")' instead of '$wanted'"
}

# every command, option and topic that the help lists
plain=$(sed 's/\\-/-/g; s/\\f[BIR]//g; s/\\&//g' mild.1)
commands=$("$mild" --help | sed -n '/^commands:/,/^$/s/^  \([a-z]*\) .*/\1/p')
[ "$(wc -w <<<"$commands")" -ge 8 ] || fail "commands: $commands"
offers "$(echo $commands)" mild ''
parts=$("$mild" actuator --help | sed -n '/^first word:/,/^$/s/^  \([a-z]*\) .*/\1/p')
[ "$(wc -w <<<"$parts")" -ge 2 ] || fail "parts of actuator: $parts"
offers "$(echo $parts)" mild actuator ''
while read -ra words; do
    command=${words[*]}
    grep -q "^\.SS mild $command$" mild.1 || fail "man: no mild $command"
    options=$("$mild" "${words[@]}" --help | sed -n '/^options:/,/^[a-z]*:$/s/^  \(--[a-z-]*\).*/\1/p')
    [[ $command = info || $command = actuator ]] || [ "$(wc -w <<<"$options")" -ge 2 ] || fail "options of $command: $options"
    offers "$(echo $options)" mild "${words[@]}" --
    for option in $options; do
        [ "$option" = --help ] || sed -n "/^.SS mild $command$/,/^.S[SH]/p" <<<"$plain" | grep -q "^$option\b" || fail "man: no $command $option"
    done
done < <(printf '%s\n' $commands; printf 'actuator %s\n' $parts)
topics=$("$mild" info --help | sed -n '/^topics:/,/^$/s/^  \([a-z]*\) .*/\1/p')
[ "$(wc -w <<<"$topics")" -ge 8 ] || fail "topics: $topics"
offers "$(echo $topics)" mild info ''

# values, also the second of a list and behind an equals sign; files are the shell's
offers 'sand_loose sand_dense sandy_loam' mild press --ground sand
offers 'rubber,foam25' mild eval --ground rubber,foam25
offers 'rubber,grass' mild eval --ground rubber,gra
offers 'con_cone con_spring' mild play --model = con
offers "$(echo $("$mild" info robots | sed -n 's/^\([a-z0-9_]*\): .*joints.*/\1/p'))" mild train --robot ''
offers '' mild train --config ''
offers '' mild eval --json =
# keys, of the sections that the command takes
offers '--terrain.kind=' mild play --terrain.ki
offers '--ground.k_pen= --ground.k_phi=' mild press --ground.k_p
offers '' mild press --task.vx
offers '' mild train --ground.k_p
"$mild" info config | sed -n 's/^\[\(.*\)\]$/\1/p; s/^\([a-z_0-9]*\) = .*/\1/p' >keys
[ "$(wc -w <<<"$(offered mild train --train.; offered mild train --ppo.; offered mild train --policy.; offered mild train --task.
    offered mild train --reward.; offered mild train --randomize.; offered mild train --terrain.)")" = $(($(wc -l <keys) - 7)) ] ||
    fail "not every key of info config is offered"
offers '' mild nonsense ''

# roff: what begins with a dot or a quote, dashes, backslashes
! grep -qE "^'" mild.1 || fail "a line begins with a quote"
! grep -E '^\.' mild.1 | grep -qvE '^\.(TH|SH|SS|TP|PP|nf|fi)( |$)' || fail "a line begins with a dot"
if command -v man >/dev/null; then
    LC_ALL=C.UTF-8 MANWIDTH=100 man --warnings -l mild.1 >page 2>warnings || fail "man"
    [ ! -s warnings ] || fail "man warns: $(head -3 warnings)"
fi

finish "man page and completion: all that the help lists"
