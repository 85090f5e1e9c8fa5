"""Points in text: what is a header, what is a row, and what is neither."""

import numpy as np
import pytest

import mpcam as mp
from mpcam.io.points import parse_points, read_points

ROWS = [[1.0, 2.0, 3.0], [4.0, 5.0, -6.5]]


@pytest.mark.parametrize(
    "text",
    [
        "1,2,3\n4,5,-6.5\n",
        "x,y,z\n1,2,3\n4,5,-6.5",
        "X [m];Y [m];Z [m];name\n1;2;3;first\n4;5;-6.5;second\n",
        '"x","y","z"\n"1","2","3"\n"4","5","-6.5"\n',
        "# points\n\nx y z\n1 2 3 9 9\n4\t5  -65e-1 # the last\n",
        "1,2,3,\n4,5,-6.5,\n",
        "\ufeff1 2 3\r\n4 5 -6.5\r\n",
    ],
)
def test_rows(text, tmp_path):
    path = tmp_path / "points.csv"
    path.write_bytes(text.encode())
    assert np.array_equal(read_points(path), ROWS)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,two,3\n4,5,6\n", ":1: '1,two,3': give three numbers"),
        ("x,y,3\n4,5,6\n", ":1: 'x,y,3': give three numbers"),
        ("x,y,z,1\n4,5,6\n", ":1: 'x,y,z,1': give three numbers"),
        ("x,y,z\na,b,c\n", ":2: 'a,b,c': give three numbers"),
        ("1,2\n3,4,5\n", ":1: '1,2' is too short"),
        ("1,,3,4\n", ":1: '1,,3,4': give three numbers"),
        (",,\n1,2,3\n", ":1: ',,': give three numbers"),
        ("1,5;2,0;3,1\n", ":1: '1,5;2,0;3,1': give decimals with a point"),
        ("1 2,3\n", ":1: '1 2,3': give three numbers"),
        ("1_000,2,3\n4,5,6\n", ":1: '1_000,2,3': give three numbers"),
        ("1.2.3 4 5\n", ":1: '1.2.3 4 5': give three numbers"),
        ("# nothing\n", "has no points"),
    ],
)
def test_what_is_no_row_is_named_by_its_line(text, message):
    with pytest.raises(mp.InputError, match=message):
        parse_points(text.splitlines(), "points.csv")
