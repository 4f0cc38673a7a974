"""Random faults of C text, for mutants.py. Made from tokens, not from a syntax tree: the tree is
formatted by clang-format, and so a binary operator is one with a space on both sides, and a
function begins in the first column."""

import dataclasses
import hashlib
import math
import re


TOKEN = re.compile(
    r"""(?P<comment>/\*.*?\*/|//[^\n]*)
      | (?P<string>"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')
      | (?P<directive>^[ \t]*\#[ \t]*\w+)
      | (?P<number>(?:0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)[uUlLfF]*)
      | (?P<name>[A-Za-z_]\w*)
      | (?P<space>(?:\s|\\\n)+)
      | (?P<sign>->|\+\+|--|<<=|>>=|\.\.\.|[-+*/%&|^<>=!]=|<<|>>|&&|\|\||\#\#|.)""",
    re.X | re.S | re.M)

TYPES = set("void char short int long float double signed unsigned const static struct union enum "
            "extern typedef inline volatile restrict register size_t _Bool bool".split())
KEYWORDS = set("return if else for while do switch case default goto break continue sizeof".split())
BINARY = {
    "+": ["-"], "-": ["+"], "*": ["/"], "/": ["*"], "%": ["*"],
    "+=": ["-=", "="], "-=": ["+=", "="], "*=": ["/="], "/=": ["*="], "|=": ["&="], "&=": ["|="],
    "<": ["<=", ">="], "<=": ["<", ">"], ">": [">=", "<="], ">=": [">", "<"],
    "==": ["!="], "!=": ["=="], "&&": ["||"], "||": ["&&"],
    "&": ["|"], "|": ["&"], "^": ["|"], "<<": [">>"], ">>": ["<<"],
}
KIND = {"+": "arithmetic", "-": "arithmetic", "*": "arithmetic", "/": "arithmetic",
        "%": "arithmetic", "<": "relation", "<=": "relation", ">": "relation", ">=": "relation",
        "==": "relation", "!=": "relation", "&&": "logic", "||": "logic", "&": "bits", "|": "bits",
        "^": "bits", "<<": "bits", ">>": "bits"}
FUNCTIONS = {"fmin": "fmax", "fmax": "fmin", "sin": "cos", "cos": "sin", "floor": "ceil",
             "ceil": "floor", "fabs": "", "fabsf": "", "sqrt": "", "abs": "", "isfinite": "!isfinite"}
# The first two arguments exchanged: the same memory, the same verdict on equality, the same number.
SYMMETRIC = set("calloc strcmp strncmp memcmp fmin fmax hypot".split())
# Not mutated inside: messages, assertions, and what frees (the sanitizers watch leaks). Nor removed.
QUIET_CALL = re.compile(r"(static_)?assert|_Static_assert|\w*printf|fputs|puts|perror|\w*_fail|"
                        r"\w*_message|usage")
FREEING_CALL = re.compile(r"free|fclose|close|unlink|remove|\w*_(free|destroy|close)")


@dataclasses.dataclass
class Token:
    kind: str
    text: str
    begin: int
    end: int


@dataclasses.dataclass
class Mutant:
    path: str  # relative to the root
    line: int
    function: str
    kind: str
    begin: int
    end: int
    text: str  # in place of source[begin:end]
    before: str
    after: str
    name: str = ""  # "path function: before -> after", the same wherever the lines move

    def key(self):
        return (self.path, self.function, self.before, self.after)


def tokens_of(source):
    """Tokens that may change: no comments, no directives but the bodies of #define."""
    tokens, position = [], 0
    while position < len(source):
        match = TOKEN.match(source, position)
        kind, position = match.lastgroup, match.end()
        if kind == "directive":
            if match.group().split("#")[1].strip() == "define":
                # skip the macro's name and, directly behind it, its parameters
                head = re.compile(r"[ \t]+\w+(\([^)]*\))?").match(source, position)
                tokens.append(Token("sign", "#define", match.start(), head.end()))
                position = head.end()
            else:
                position = re.compile(r"(?:\\\n|/\*.*?\*/|[^\n])*", re.S).match(source, position).end()
        elif kind not in ("space", "comment"):
            tokens.append(Token(kind, match.group(), match.start(), match.end()))
    return tokens


def partners(tokens):
    """Index of the closing token of every opening one, and back."""
    pair, stack = {}, []
    for i, token in enumerate(tokens):
        if token.kind != "sign":
            continue
        if token.text in "([{":
            stack.append(i)
        elif token.text in ")]}" and stack:
            opening = stack.pop()
            pair[opening], pair[i] = i, opening
    return pair


def plain(line):
    """A line of code without its remark, so that a remark's words change no mutant's name."""
    return " ".join(re.sub(r"/\*.*?(\*/|$)", " ", line, flags=re.S).split())


def is_type(token):
    return token.kind == "name" and (token.text in TYPES or token.text.endswith("_t") or
                                     re.fullmatch(r"(mj)?[A-Z][a-z]\w*|FILE|Real", token.text) is not None)


class File:
    """One source file and all mutants of it."""

    def __init__(self, path, source):
        self.path = path
        self.source = source
        self.tokens = tokens_of(self.source)
        self.pair = partners(self.tokens)
        self.starts = [0] + [m.end() for m in re.finditer("\n", self.source)]
        self.quiet = self.quiet_places()
        self.functions = self.function_of_line()

    def line_of(self, position):
        low, high = 0, len(self.starts)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self.starts[middle] <= position else (low, middle)
        return low

    def function_of_line(self):
        """The function, table or macro that each line belongs to, by its first column."""
        names, current = [], ""
        for line in self.source.split("\n"):
            if re.match(r"[A-Za-z_]", line):
                found = re.search(r"([A-Za-z_]\w*)\s*(?:\(|\[|=|\{)", line)
                current = found.group(1) if found else current
            elif line.startswith("#define"):
                current = re.match(r"#define\s+(\w+)", line).group(1)
            names.append(current)
        return names

    def quiet_places(self):
        quiet = set()
        for i, token in enumerate(self.tokens[:-1]):
            silent = QUIET_CALL.fullmatch(token.text) or FREEING_CALL.fullmatch(token.text)
            if token.kind == "name" and silent and i + 1 in self.pair:
                quiet.update(range(i, self.pair[i + 1] + 1))
        return quiet

    def spaced(self, i):
        token = self.tokens[i]
        return (self.source[token.begin - 1].isspace() and token.end < len(self.source) and
                self.source[token.end].isspace())

    def declares(self, i):
        """Whether the `[` at i belongs to a declaration (its number is a size, not an index)."""
        while self.tokens[i - 1].text == "]" and i - 1 in self.pair:
            i = self.pair[i - 1]
        before = i - 2  # what stands before the name
        while before > 0 and self.tokens[before].text == "*":
            before -= 1
        if before >= 0 and is_type(self.tokens[before]):
            return True
        # a further name of a declaration: back to the start of the statement, over no `=` of ours
        depth, j = 0, i - 1
        while j >= 0:
            text = self.tokens[j].text
            if text in ")]}" and j in self.pair:
                j = self.pair[j]
            elif text in (";", "{", "}", "(", "#define"):
                break
            elif text == "," and depth == 0:
                depth = 1
            elif text == "=" and depth == 0:
                return False
            j -= 1
        return depth == 1 and j + 1 < i and is_type(self.tokens[j + 1])

    def make(self, kind, begin, end, text):
        first, last = self.line_of(begin), self.line_of(max(begin, end - 1))
        head = self.source[self.starts[first]:begin]
        stop = self.source.find("\n", max(begin, end - 1))
        tail = self.source[end:stop if stop >= 0 else None]
        text += "\n" * (self.source[begin:end].count("\n") - text.count("\n"))
        squeeze = lambda s: plain(s.replace("\\\n", " ").rstrip("\\"))
        before, after = squeeze(head + self.source[begin:end] + tail), squeeze(head + text + tail)
        return Mutant(self.path, first + 1, self.functions[first], kind, begin, end, text, before,
                      after, f"{self.path} {self.functions[first]}: {before} -> {after}")

    def mutants(self):
        found = []
        for i, token in enumerate(self.tokens):
            if i in self.quiet:
                continue
            if token.kind == "number":
                found += self.numbers(i)
            elif token.kind == "sign":
                found += self.operators(i)
                if token.text == "[" and i in self.pair:
                    found += self.indices(i)
            elif token.kind == "name":
                found += self.names(i)
                found += self.removal(i)
        unique = {}
        for mutant in found:
            if mutant.before != mutant.after:
                same = unique.setdefault(mutant.key(), [])
                if all(other.begin != mutant.begin for other in same):
                    same.append(mutant)
        for same in unique.values():  # the second of two alike gets a number
            for number, mutant in enumerate(same[1:], 2):
                mutant.name += f" #{number}"
        return [mutant for same in unique.values() for mutant in same]

    def numbers(self, i):
        token, opening = self.tokens[i], i - 1
        in_brackets = self.tokens[opening].text == "[" and self.pair.get(opening) == i + 1
        if in_brackets and (self.declares(opening) or self.tokens[opening - 1].text in "{,"):
            return []
        text, suffix = re.fullmatch(r"(.*?)([uUlLfF]*)", token.text).groups()
        if re.match("0[xX]", token.text):
            values = [f"({token.text} ^ 1)"]
        elif re.fullmatch(r"\d+", text):
            value = int(text)
            near = (value + 1, value - 1) if value < 10 else (2 * value, value // 2)
            values = [f"{v}{suffix}" for v in near if v >= 0]
        else:
            value = float(text)
            values = [f"{v!r}{suffix}" for v in (0.0, 1.0, 2 * value, 0.8 * value) if v != value]
            if value:
                values.append(f"(-{token.text})")
        kind = "index" if in_brackets else "number"
        return [self.make(kind, token.begin, token.end, v) for v in values]

    def operators(self, i):
        token = self.tokens[i]
        found = []
        if token.text in BINARY and (self.spaced(i)):
            kind = KIND.get(token.text, "assignment")
            found += [self.make(kind, token.begin, token.end, t) for t in BINARY[token.text]]
        elif token.text == "-" and not self.spaced(i):
            found.append(self.make("sign", token.begin, token.end, ""))
        elif token.text == "!":
            found.append(self.make("condition", token.begin, token.end, ""))
        elif token.text in ("++", "--") and not self.in_for(i):
            found.append(self.make("assignment", token.begin, token.end,
                                   "--" if token.text == "++" else "++"))
        return found

    def in_for(self, i):
        """Whether i is in the head of a loop: counting there the other way only ever hangs."""
        j = i
        while j > 0 and self.tokens[j].text not in "{}":
            if self.tokens[j].text == "(" and self.tokens[j - 1].text == "for":
                return self.pair.get(j, 0) > i
            j -= 1
        return False

    def indices(self, i):
        closing, before = self.pair[i], self.tokens[i - 1]
        if (before.kind != "name" and before.text not in ")]") or is_type(before):
            return []
        if closing == i + 1 or self.tokens[i + 1].kind == "number" or self.declares(i):
            return []
        end = self.tokens[closing].begin
        return [self.make("index", end, end, text) for text in (" + 1", " - 1")]

    def names(self, i):
        token, following = self.tokens[i], i + 1
        if following not in self.pair or self.tokens[following].text != "(":
            return []
        begin, end = self.tokens[following].end, self.tokens[self.pair[following]].begin
        if token.text in ("if", "while"):
            return [self.make("condition", begin, end, f"!({self.source[begin:end]})")]
        if token.text in KEYWORDS or token.text in TYPES or not self.source[token.end] == "(":
            return []
        found = []
        if token.text in FUNCTIONS:
            found.append(self.make("function", token.begin, token.end, FUNCTIONS[token.text]))
        else:
            for a, b in (("min", "max"), ("max", "min")):
                other = re.sub(rf"(^|_){a}(?=_|$)", rf"\g<1>{b}", token.text)
                if other != token.text:
                    found.append(self.make("function", token.begin, token.end, other))
        arguments, start, j = [], begin, following + 1
        while j <= self.pair[following]:
            text = self.tokens[j].text
            if text in "([{" and j in self.pair:
                j = self.pair[j]
            elif text == "," or j == self.pair[following]:
                arguments.append((start, self.tokens[j].begin))
                start = self.tokens[j].end
            j += 1
        declaration = self.source[:token.begin].endswith("\n") or is_type(self.tokens[i - 1]) or (
            self.tokens[i - 1].text == "*" and is_type(self.tokens[i - 2]))
        if not declaration:
            pairs = list(zip(arguments, arguments[1:]))
            for (a, b), (c, d) in pairs[1:] if token.text in SYMMETRIC else pairs:
                first, second = self.source[a:b].strip(), self.source[c:d].strip()
                if first != second:
                    a += len(self.source[a:b]) - len(self.source[a:b].lstrip())
                    found.append(self.make("arguments", a, d, f"{second}, {first}"))
        return found

    def removal(self, i):
        """The statement that begins at i, removed; declarations and what returns or frees stay."""
        before, token = self.tokens[i - 1], self.tokens[i]
        if i + 1 == len(self.tokens):
            return []  # the body of a macro at the end of a header
        begins = before.text in (";", "{", "}", "else") or (
            before.text == ")" and self.tokens[self.pair.get(i - 1, 0) - 1].text in ("if", "for", "while"))
        if not begins or self.in_for(i) or is_type(token) or FREEING_CALL.fullmatch(token.text) or (
                token.text in KEYWORDS and token.text not in ("break", "continue")):
            return []
        following = self.tokens[i + 1]
        if following.kind == "name" or (following.text == "*" and not self.spaced(i + 1)):
            return []  # a declaration with a type that we do not know
        j = i
        while j < len(self.tokens) and self.tokens[j].text != ";":
            if self.tokens[j].text in "([" and j in self.pair:
                j = self.pair[j]
            elif self.tokens[j].text in "{})]:,#define":
                return []
            j += 1
        if j == len(self.tokens):
            return []
        return [self.make("removal", token.begin, self.tokens[j].begin, "")]


def draw(files, seed):
    """All mutants in random order: a line is as likely as any other, and on it a kind as any
    other. Each has a random number of its own, so an edit moves only the mutants of its line."""
    order = []
    for file in files:
        lines = {}
        for mutant in file.mutants():
            lines.setdefault(mutant.line, {}).setdefault(mutant.kind, []).append(mutant)
        for kinds in lines.values():
            for alike in kinds.values():
                weight = 1 / (len(kinds) * len(alike))
                for mutant in alike:
                    digest = hashlib.sha256(f"{seed}:{mutant.name}".encode()).digest()
                    uniform = (int.from_bytes(digest[:8], "big") + 0.5) / 2.0**64
                    order.append((-math.log(uniform) / weight, mutant.name, mutant))
    return [mutant for _, _, mutant in sorted(order, key=lambda entry: entry[:2])]
