"""The line of every TOML key. The documents say it themselves: each @ is replaced by the number of its own line."""

import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpcam.io.toml_lines import key_lines, line_of

NASTY = """
# a comment with [brackets] and = signs and "quotes
top = @  # [not.a.table]
"quoted key" = @
'literal "key"' = @
"esc\\"aped.key" = @
dotted.inner = @
dotted . "other part" . deep = @

strings = ["a ] b", 'c # d', "e \\" ] f", '''g ]
[h] # ''', @]
after = @
text = \"\"\"
[table]
key = 1
\\\"\"\" still in it ]
\"\"\"
tricky = \"\"\"two quotes at the end: \"\"\"\"\"
empty = ""
also_empty = ''
single = '''it's ''quoted'' '''''
behind = @
array = [ # comment ]
    @,
    [@, @], # nested ] [
    { x = @, y.z = [@,
        @] },

    @ ,
] # done
numbers = [1, 2,
  -1.5e3, inf, 0x1F, 1979-05-27 07:32:00, true] # then
inline = { a = @, b = { c = @ }, "d e" = @ }
[table]
key = @
[ table . sub ] # comment
key = @
[deep.er.est]
key = @
[deep]
key = @

[[list]]
key = @
[[list.inner]]
key = @
[[list.inner]]
key = @
[list.inner.table]
key = @
[[list]]
[list.table]
key = @
[[list.inner]]
key = @
  [[ "odd ] name" ]]
  key = @
"""


def numbered(text):
    return "\n".join(line.replace("@", str(number)) for number, line in enumerate(text.split("\n"), start=1))


def leaves(value, path=()):
    if isinstance(value, (dict, list)):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(item, (*path, key))
    else:
        yield path, value


def check(text):
    """Every leaf has a line, and those that name their line are right; returns how many did."""
    lines = key_lines(text)
    right = 0
    for path, value in leaves(tomllib.loads(text)):
        assert path in lines, path
        if type(value) is int and path[0] != "numbers":
            assert lines[path] == value, path
            right += 1
    return right


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_nasty_document(newline):
    text = numbered(NASTY).replace("\n", newline)
    assert check(text) == NASTY.count("@")


def test_tables_have_the_line_of_their_header():
    lines = key_lines('[a.b]\nx = 1\n[a]\ny = 2\n[[c]]\n\n[[c]]\nz.k = 3\n"q.r" = 4')
    assert lines == {
        ("a",): 3,
        ("a", "b"): 1,
        ("a", "b", "x"): 2,
        ("a", "y"): 4,
        ("c",): 5,
        ("c", 0): 5,
        ("c", 1): 7,
        ("c", 1, "z"): 8,
        ("c", 1, "z", "k"): 8,
        ("c", 1, "q.r"): 9,
    }


def test_line_of_falls_back_to_what_is_written():
    lines = key_lines("\n[camera]\nsize = [1,\n2]")
    assert line_of(lines, ("camera", "size", 1)) == 4
    assert line_of(lines, ("camera", "size", 7)) == 3
    assert line_of(lines, ("camera", "fov")) == 2
    assert line_of(lines, ("mesh", 0)) == 1
    assert line_of({}, ()) == 1


@pytest.mark.parametrize("text", ["", "\n\n", "# nothing", "# nothing\n", "\t \r\n"])
def test_empty_documents(text):
    assert key_lines(text) == {}


def test_invalid_text_ends():
    for text in ("a = [1, }", "a = [}", "a = {b = [1", "[", "a", "= = =", 'a = """x', "[[a\n]"):
        try:
            key_lines(text)
        except ValueError:
            pass


def test_long_documents_take_linear_time():
    text = numbered("\n".join(f"[[mesh]]\nrotate.axis = [0, @, 1]\nname = 'mesh {k} [ # '" for k in range(20_000)))
    lines = key_lines(text)
    assert lines[("mesh", 19_999, "rotate", "axis", 1)] == 3 * 19_999 + 2


# Documents made at random: the same kinds of pieces, in any order.
NAMES = st.sampled_from(["a", "b-c", "_1", '"x y"', '"]"', "'#'", '"é\\u00e9"', '"="', "''"])
SPACE = st.sampled_from(["", " ", "\t"])
BREAK = st.sampled_from(["", " ", "\n", "\n  # ] } \" '\n", "\r\n\r\n"])
TEXTS = st.sampled_from(
    [
        '"]"',
        "'#'",
        '"\\""',
        '"""\n]\n"""',
        "'''\n[x]\n#'''",
        '""" "" """',
        '""',
        "''",
        '"\\\\"',
        "'''a''''",
        "1.5",
        "-inf",
    ]
)


def arrays(values):
    def text(parts):
        return "[" + ",".join(before + value + after for before, value, after in parts) + "]"

    return st.lists(st.tuples(BREAK, values, BREAK), max_size=3).map(text)


def tables(values):
    def text(parts):
        return "{" + ",".join(f" {name}{space}={space}{value} " for (name, space, value) in parts) + "}"

    return st.lists(st.tuples(NAMES, SPACE, values), max_size=3, unique_by=lambda part: part[0]).map(text)


VALUES = st.recursive(st.just("@") | TEXTS, lambda inner: arrays(inner) | tables(inner), max_leaves=6)
PAIRS = st.lists(st.tuples(NAMES, SPACE, VALUES), max_size=4, unique_by=lambda part: part[0]).map(
    lambda parts: "".join(f"{space}{name}{space}={space}{value}{space}# ]\n" for name, space, value in parts)
)


@st.composite
def documents(draw):
    text = draw(PAIRS)
    for number in range(draw(st.integers(0, 5))):
        kind = draw(st.sampled_from(["[t{0}]", "[ t{0} . 'u v'.w ]", "[[list]]", "[[list.'in ner']]", "[list.t{0}]"]))
        if kind.startswith("[list.") or kind.startswith("[[list."):
            text += "[[list]]\n"
        text += kind.format(number) + draw(st.sampled_from(["\n", " # [x]\n", "\n\n"])) + draw(PAIRS)
    return numbered(text)


@settings(max_examples=150, deadline=None)
@given(documents())
def test_random_documents(text):
    check(text)
