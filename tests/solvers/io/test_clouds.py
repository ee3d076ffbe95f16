"""Written clouds are read back to the last bit, in every format; damaged files give just an error with its line."""

from __future__ import annotations

import io
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.io.clouds import _PCD, MOST_POINTS, read
from solvers.io.pcd import points
from solvers.io.text import _without_tail
from tests.solvers.io.compression import compress

numbers = st.floats(-1e12, 1e12, allow_nan=False).map(lambda v: v + 0.0)
clouds = st.integers(2, 3).flatmap(lambda d: st.lists(st.tuples(*[numbers] * d), min_size=1, max_size=12)).map(np.array)


def csv(p, separator=",", header=True, end="\n"):
    names = [separator.join("xyz"[: p.shape[1]])] if header else []
    return end.join([*names, *(separator.join(repr(float(v)) for v in row) for row in p)]).encode()


def ply(p, kind="ascii"):
    axes = "".join(f"property double {axis}\n" for axis in "xyz"[: p.shape[1]])
    head = f"ply\nformat {kind} 1.0\ncomment made here\nelement vertex {len(p)}\n{axes}property uchar red\n"
    head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    if kind == "ascii":
        rows = "".join(" ".join(repr(float(v)) for v in row) + " 255\n" for row in p)
        return (head + rows + "3 0 0 0\n").encode()
    order = "<" if "little" in kind else ">"
    return head.encode() + b"".join(struct.pack(f"{order}{p.shape[1]}dB", *row, 9) for row in p) + b"\x03" + bytes(12)


def pcd(p, kind="ascii"):
    d = p.shape[1]
    head = f"# .PCD v0.7\nVERSION 0.7\nFIELDS {' '.join('xyz'[:d])} normal\nSIZE {'8 ' * d}4\nTYPE {'F ' * d}F\n"
    head += f"COUNT {'1 ' * d}3\nWIDTH {len(p)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(p)}\nDATA {kind}\n"
    if kind == "ascii":
        return (head + "".join(" ".join(repr(float(v)) for v in row) + " 0 0 1\n" for row in p)).encode()
    if kind == "binary_compressed":  # each field of all points in turn
        body = b"".join(p[:, k].astype("<f8").tobytes() for k in range(d)) + struct.pack("<3f", 0, 0, 1) * len(p)
        payload = compress(body)
        return head.encode() + struct.pack("<2I", len(payload), len(body)) + payload
    return head.encode() + b"".join(struct.pack(f"<{d}d3f", *row, 0, 0, 1) for row in p)


def bare(data):
    r"""The same data with lines ended by \r alone; binary numbers after a header stay unchanged."""
    head, last, body = data.partition(b"end_header\n" if data.startswith(b"ply") else b"DATA binary\n")
    return (head + last).replace(b"\n", b"\r") + (body.replace(b"\n", b"\r") if b" ascii" in head else body)


WRITERS = {
    "csv": csv,
    "csv without names": lambda p: csv(p, header=False),
    "csv from Windows": lambda p: b"\xef\xbb\xbf" + csv(p, ";", end="\r\n"),
    "csv from a spreadsheet": lambda p: csv(p, "\t").decode().encode("utf-16"),
    "xyz": lambda p: b"# a scan\n\n" + csv(p, "  ", header=False) + b" # the last\n",
    "xyz of CloudCompare": lambda p: b"//X Y Z\r" + csv(p, " ", header=False, end="\r"),
    "ply": ply,
    "ply little": lambda p: ply(p, "binary_little_endian"),
    "ply big": lambda p: ply(p, "binary_big_endian"),
    "ply of bare returns": lambda p: bare(ply(p)),
    "ply little of bare returns": lambda p: bare(ply(p, "binary_little_endian")),
    "pcd": pcd,
    "pcd binary": lambda p: pcd(p, "binary"),
    "pcd compressed": lambda p: pcd(p, "binary_compressed"),
    "pcd of bare returns": lambda p: bare(pcd(p)),
    "pcd binary of bare returns": lambda p: bare(pcd(p, "binary")),
}


@pytest.mark.parametrize("name", WRITERS)
@given(points=clouds)
@settings(max_examples=12, deadline=None)
def test_what_is_written_is_read_back(name, points):
    """Every format keeps every bit, in 2-D and 3-D."""
    cloud = read(WRITERS[name](points))
    assert np.array_equal(cloud.points, points)
    assert cloud.points.dtype == np.float64


@pytest.mark.parametrize("name", WRITERS)
@given(data=st.data())
@settings(max_examples=15, deadline=None)
def test_damage_is_a_value_error_or_a_cloud(name, data):
    """Bytes cut, replaced and inserted anywhere give finite points or a ValueError, and nothing else."""
    whole = bytearray(WRITERS[name](np.arange(12.0).reshape(4, 3)))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(whole)))
        end = data.draw(st.integers(at, min(len(whole), at + 8)))
        whole[at:end] = data.draw(st.binary(max_size=8))
    survives(bytes(whole))


@given(st.one_of(st.binary(max_size=200), st.text('0123456789.,;-+eEnaif \t\n\r#/"_xyz', max_size=200).map(str.encode)))
@settings(max_examples=150, deadline=None)
def test_any_bytes_are_a_cloud_or_a_value_error(data):
    survives(data)


def survives(data):
    try:
        cloud = read(data)
    except ValueError:
        return
    assert cloud.points.ndim == 2
    assert cloud.points.shape[1] in (2, 3)
    assert np.isfinite(cloud.points).all()


@pytest.mark.parametrize(
    ("data", "line", "message"),
    [
        (b"", 1, "no line with numbers"),
        (b"x,y\n", 2, "no line follows"),
        (b"# a\n# b\n\nx,y\n", 5, "no line follows"),
        (b"# a\n# b\nOFF\n1 2\n", 3, "'OFF' is one column"),
        (b"x,y\n1,2\n\n3,four\n", 4, "'four' is not a number"),
        (b"# a\n1 2 3\n4 5\n", 3, "2 fields found; expected 3, separated by spaces"),
        (b"1,5;2,5\n", 1, "decimal point"),
        (b"1;2\n1,5;2\n", 2, "decimal point"),
        (b"1 b\n", 1, "'b' is not a number"),
        (b'"1,5","2,5"\n"3,5","4,5"\n', 1, "'1,5' is not a number; numbers are written with a decimal point"),
        (b'"1,234.5","2,345.6"\n"1,234.6","2,3"\n', 2, "'1,234.6' is not a number; numbers are written without sep"),
        (b"x,y\n,\n1,2\n", 2, "'' is not a number; write nan where a number is missing"),
        (b"12\n1 2\n", 1, "one column"),
        (b"12\t\n13\n", 1, "one column"),
        (b"1, 2\t3\n", 1, "'1, 2' is not a number; expected one separator throughout"),
        (b"1,2 3\n", 1, "'2 3' is not a number; expected one separator throughout"),
        (b"a b\tc\n1 2\t3\n", 2, "'1 2' is not a number; expected one separator throughout"),
        (b"1\t2\n3,4\n", 2, "1 field found; expected 2, separated by tabs"),
        (b"1_0 2\n", 1, "'1_0' is not a number"),
        (b"1 2\n3\x004\n", 2, "zero byte"),
        (ply(np.eye(3)).replace(b"0.0 1.0 0.0 255", b"0.0 1.0 O.0 255"), 13, "'O.0' is not a number"),
        (ply(np.eye(3)).replace(b"property double x", b"property float128 x"), 5, "float128"),
        (ply(np.eye(3)).replace(b"double x", b"double a"), 4, "expected x and y"),
        (ply(np.eye(3)).replace(b"uchar red", b"list uchar int red"), 4, "a property of the vertices is a list"),
        (ply(np.eye(3)).replace(b"vertex 3", b"vertex 1000001"), 4, "1000001 vertices are more than the limit"),
        (ply(np.eye(3)).replace(b"end_header", b"the end"), 15, "within its header"),
        (ply(np.eye(3)).replace(b"vertex 3", b"vertex 30"), 15, "after 4 vertices; expected 30"),
        (pcd(np.eye(3)).replace(b"FIELDS x", b"FIELDS a"), 3, "expected x and y"),
        (pcd(np.eye(3)).replace(b"0.0 1.0 0.0 0", b"0.0 1.0 0,0 0"), 13, "decimal point"),
        (pcd(np.eye(3)).replace(b"SIZE 8 8", b"SIZE 8 7"), 4, "TYPE 'F' and SIZE '7' is unknown"),
        (pcd(np.eye(3)).replace(b"SIZE 8 8", b"SIZE 8"), 4, "one entry for each of the 4 fields"),
        (pcd(np.eye(3)).replace(b"TYPE F F", b"TYPE F X"), 5, "TYPE 'X' and SIZE '8' is unknown"),
        (pcd(np.eye(3)).replace(b"TYPE F F", b"TYPE F"), 5, "one entry for each of the 4 fields"),
        (pcd(np.eye(3)).replace(b"POINTS 3", b"POINTS 1000001"), 10, "1000001 points are more than the limit"),
        (re.sub(rb"POINTS.*\n", b"", pcd(np.eye(3)).replace(b"WIDTH 3", b"WIDTH 1000001")), 7, "more than the limit"),
        (pcd(np.eye(3)).replace(b"DATA ascii", b"DATA zip"), 11, "expected ascii, binary or binary_compressed"),
        (pcd(np.eye(3)).replace(b"VIEWPOINT", b"VIEW"), 9, "'VIEW' is not understood"),
        (bare(ply(np.eye(3)).replace(b"property double x", b"property float128 x")), 5, "float128"),
        (bare(pcd(np.eye(3)).replace(b"VIEWPOINT", b"VIEW")), 9, "'VIEW' is not understood"),
        (pcd(np.eye(3), "binary").replace(b"1 3\n", b"1 " + b"0" * 8 + b"1" * 90 + b"\n"), 6, "from 1 to 10000"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(data, line, message):
    """The message gives the line as an editor counts it, and what was found there."""
    with pytest.raises(ValueError, match=f"^line {line}: .*{re.escape(message)}"):
        read(data)


def test_columns_are_taken_by_name():
    """They are found wherever x, y and z are; without z the cloud is planar."""
    cloud = read(b'"time";"Z";"X";"Y"\n0;3;1;2\n1;6;4;5\n')
    assert cloud.points.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert cloud.notices == ("columns other than xyz were left out",)
    assert read(b"id,x,y\n7,1,2\n").points.tolist() == [[1, 2]]
    assert "first 3 were taken" in read(b"east,north,height\n1,2,3\n").notices[0]
    assert read(b"seconds,x_m,y_m,phi_rad\n0,1,2,3\n").points.tolist() == [[1, 2]]
    assert read(b"time\tx [m]\tY(m)\n0\t1\t2\n").points.tolist() == [[1, 2]]
    assert "first 3 were taken" in read(b"x_1,x_2,y\n1,2,3\n").notices[0]
    # A comment's names are told of too: NumPy's header "time px py" would make a cloud in space of a plane one.
    assert "x and y in line 2: the first 3 were taken" in read(b"# made by me\n# time px py\n0 1 2\n").notices[0]
    assert read(b"# 0 0\n1 2\n").notices == (), "numbers commented out are no names"


def test_names_that_are_paths_stand_for_their_last_part():
    """As ROS writes the fields of a message; beside a plain x and y they stand for nothing."""
    recorded = read(b"%time,field.header.frame_id,field.point.x,field.point.y\n17,laser,1,2\n18,laser,3,4\n")
    assert recorded.points.tolist() == [[1, 2], [3, 4]]
    assert read(b"%time,field.x,field.y\n17,1,2\n").points.tolist() == [[1, 2]]
    assert read(b"t,/odom/position/x,/odom/position/y\n17,1,2\n").points.tolist() == [[1, 2]]
    assert read(b"normal.x,normal.y,x,y\n0,1,2,3\n").points.tolist() == [[2, 3]]
    with pytest.raises(ValueError, match=r"^line 1: two columns are named x: 'position.x' and 'orientation.x'"):
        read(b"position.x,position.y,orientation.x\n1,2,3\n")


def test_a_first_line_may_count_the_others():
    """PTS files begin so, and CloudCompare's text has the count below the names. Any other number is one column."""
    assert read(b"2\n1 2 3 -900 7 7 7\n4 5 6 -900 7 7 7\n").points.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert read(b"//Z,X,Y,R\n2\n3,1,2,0\n6,4,5,0\n").points.tolist() == [[1, 2, 3], [4, 5, 6]]
    with pytest.raises(ValueError, match=r"^line 1: '3' is one column"):
        read(b"3\n1 2 3\n4 5 6\n")


@pytest.mark.parametrize(
    "data",
    [
        *[b'name,x,y\n"a, b",1,2\nc,3,4\n', b'x;y;name\n1;2;"a; b"\n"3";"4";\n', b'"a; b",x,y\n0,1,2\n0,3,4\n'],
        *[b'x,y,size\n1,2,5" pipe\n3,4,"6"" pipe"\n', b'x\ty\tname\n1\t2\t"a\tb"\n3\t4\tc\n'],
    ],
)
def test_a_separator_between_quotation_marks_is_text(data):
    """Otherwise "1,5","2,5", as pandas writes decimal commas, would be four columns."""
    assert read(data).points.tolist() == [[1, 2], [3, 4]]


@pytest.mark.parametrize(
    ("names", "axis", "both"),
    [
        ("x,y,x,y", "x", "'x' and 'x'"),
        ("id,x,y,x", "x", "'x' and 'x'"),
        ("X,Y,Z,x,y,z", "x", "'X' and 'x'"),
        ("x_m,x,y", "x", "'x_m' and 'x'"),
        ("x,y,z,Z", "z", "'z' and 'Z'"),
    ],
)
@pytest.mark.parametrize("mark", ["", "# "])
def test_an_axis_named_twice_is_refused(names, axis, both, mark):
    """Of two clouds side by side, the first three columns would be a cloud in space."""
    numbers = ",".join(map(str, range(names.count(",") + 1)))
    message = f"line 1: two columns are named {axis}: {both}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        read(f"{mark}{names}\n{numbers}\n".encode())


@pytest.mark.parametrize(
    "data",
    [
        *[b"1 2\t\n3 4", b"1 2\t\n3 4\t\n", b"1\t2\t\t\n3\t4\t\n", b"1,2\t\n3,4\n", b"1;2\n3;4\t\n"],
        *[b"x\ty\t\n1\t2\n3\t4\n", b"x\ty\n1\t2\t\n3\t4\n", b"1 2 \t # a note\n3 4\n"],
    ],
)
def test_tabs_at_the_end_of_a_line_are_nothing(data):
    cloud = read(data)
    assert cloud.points.tolist() == [[1, 2], [3, 4]]
    assert cloud.notices == ()


@pytest.mark.parametrize("data", [b"1,2,\n3,4,\n", b"1;2;\n3;4\n", b"1,2\n3,4,,\n", b"1,2,,\n3,4 # a note\n"])
def test_separators_at_the_end_of_a_line_are_nothing(data):
    """Spreadsheets and loggers write them. A number in such a place on a later line is an error."""
    assert read(data).points.tolist() == [[1, 2], [3, 4]]
    with pytest.raises(ValueError, match="line 2: 3 fields found; expected 2"):
        read(b"1,2,\n3,4,5\n")


class Fields(list[str]):
    """Fields that count how often they are copied by slicing."""

    copies = 0

    def __getitem__(self, key):
        part = super().__getitem__(key)
        if not isinstance(key, slice):
            return part
        fields = Fields(part)
        fields.copies = self.copies + 1
        return fields


def test_many_separators_at_the_end_of_a_line_are_cut_at_once():
    """Cut one by one, each cut would copy what is left: 300,000 of them took over a minute."""
    assert read(b"1,2" + b"," * 300_000 + b"\n").points.tolist() == [[1.0, 2.0]]
    bare = _without_tail(Fields(["1", "2", *[""] * 500]))
    assert (bare, bare.copies) == (["1", "2"], 1)


@pytest.mark.parametrize(
    "data",
    [
        *[b"1 2\t3\n4 5\t6\n", b"1\t2\t3\n4 5 6\n", b"1 2 3\n4\t5\t6\n", b"1 2\t3\n4\t5 6\n"],
        *[b"x y\tz\n1 2\t3\n4 5 6\n", b"x\ty\tz\n1 2 3\n4\t5\t6\n"],
    ],
)
def test_spaces_and_tabs_may_both_stand_between_numbers(data):
    assert read(data).points.tolist() == [[1, 2, 3], [4, 5, 6]]


def test_between_tabs_a_field_may_have_spaces_or_be_empty():
    """It may be in an unused column; if x is empty, y is not taken in its place."""
    cloud = read(b"x\ty\tnote\n1\t2\ta b\n3\t4\t\n")
    assert cloud.points.tolist() == [[1, 2], [3, 4]]
    assert read(b"1\t2\t3\t4\n5\t6\t7\t\n").points.tolist() == [[1, 2, 3], [5, 6, 7]]
    for data in (b"\t1\t2\n", b"1\t\t3\n", b"x\ty\tz\n\t2\t3\n"):
        with pytest.raises(ValueError, match="'' is not a number"):
            read(data)


def test_a_comment_before_the_numbers_names_the_columns_too():
    """numpy.savetxt writes names this way. A comment that does not name the columns, or is further up, is just a
    comment."""
    text = io.StringIO()
    np.savetxt(text, [[1.0, 2.0, 200.0], [3.0, 4.0, 100.0]], delimiter=",", header="x,y,intensity")
    cloud = read(text.getvalue().encode())
    assert cloud.points.tolist() == [[1, 2], [3, 4]]
    assert cloud.notices == ("columns other than xy were left out",)
    assert read(b"// z y x\n3 2 1\n").points.tolist() == [[1, 2, 3]]
    for comment in (b"# a scan of\n", b"# y x\n", b"# z y x\n\n", b"#\n"):
        assert read(comment + b"3 2 1\n").points.tolist() == [[3, 2, 1]]


def test_a_last_column_without_a_name_is_left_out():
    """This is the column after a tab that ends the names; if no line has a value there, the tab is ignored."""
    cloud = read(b"x\ty\t\n1\t2\t5\n3\t4\t\n")
    assert cloud.points.tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert cloud.notices == ("columns other than xy were left out",)
    assert read(b"x\ty\t\n1\t2\n3\t4\t\n").notices == ()


def test_points_that_are_not_there_are_left_out_with_a_notice():
    """PCD marks missing returns with NaN; a cloud with nothing else is refused."""
    p = np.array([[1.0, 2.0, 3.0], [np.nan] * 3, [4.0, np.inf, 6.0]])
    cloud = read(pcd(p))
    assert cloud.points.tolist() == [[1, 2, 3]]
    assert cloud.notices == ("2 rows with NaN or infinity left out",)
    with pytest.raises(ValueError, match="no point is left"):
        read(pcd(p[1:]))
    with pytest.raises(ValueError, match="none beyond 1e\\+150"):
        read(b"1e200 1\n2 3\n")


def test_what_is_too_large_is_refused_before_it_is_read():
    """The counts in a header are not trusted: no memory is allocated for them."""
    for data in (ply(np.eye(3)), pcd(np.eye(3))):
        huge = re.sub(rb"(vertex|WIDTH|POINTS) 3", rb"\1 %d" % (MOST_POINTS + 1), data)
        with pytest.raises(ValueError, match="more than the limit of 1000000"):
            read(huge)
    with pytest.raises(ValueError, match=r"24\.1 MB are more than the limit of 24 MB"):
        read(bytes(24_000_001))


@pytest.mark.parametrize("name", ["file.txt", Path("file.txt"), None])
def test_a_name_in_place_of_bytes_is_refused(name):
    message = f"data: expected the file's bytes, e.g. Path(name).read_bytes(), got {type(name).__name__}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        read(name)


def test_a_field_of_several_numbers_moves_the_columns_of_a_pcd():
    head = "VERSION 0.7\nFIELDS normal x y\nSIZE 4 4 4\nTYPE F F F\nCOUNT 3 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n"
    text = f"# .PCD v0.7\n{head}DATA ascii\n9 9 9 1 2\n8 8 8 3 4\n"
    assert points(text.encode(), 10)[0].tolist() == [[1.0, 2.0], [3.0, 4.0]]


@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
@pytest.mark.parametrize(
    "head", [b"# made by foo\n", b"#.PCD v.7\n", b"\n", b"\r\n", b" \n#\n\n# a\n", b"\xef\xbb\xbf", b""]
)
def test_a_pcd_may_begin_with_comments_blank_lines_or_a_byte_order_mark(head, kind):
    p = np.arange(12.0).reshape(4, 3)
    cloud = read(head + pcd(p, kind).removeprefix(b"# .PCD v0.7\n"))
    assert cloud.format.startswith("PCD")
    assert cloud.points.tolist() == p.tolist()


@pytest.mark.parametrize("head", [b"# VERSION 7\n", b"# a\n# .PCD v.7 was its source\n", b"VERSIONS FIELDS\n"])
def test_text_with_a_pcd_s_words_is_text(head):
    cloud = read(head + b"1 2\n")
    assert cloud.format == "text separated by spaces"
    assert cloud.points.tolist() == [[1, 2]]


@pytest.mark.parametrize("filling", [b"#\n", b"# a\n\n", b"\n", b"# ", b" \n#\t"])
def test_a_file_is_recognised_in_one_pass(filling):
    """A pattern that tries a comment's parts in turn takes minutes for a million of them."""
    assert not _PCD.match(filling * 1_000_000 + b"\n1 2\n")
    assert _PCD.match(filling * 1_000_000 + b"\nFIELDS x y\n")


def test_a_ply_may_begin_with_a_byte_order_mark():
    assert read(b"\xef\xbb\xbf" + ply(np.eye(3))).points.tolist() == np.eye(3).tolist()


def test_compressed_points_that_are_not_all_there_are_refused():
    """Their two sizes missing, another size than the header's fields have, and bytes cut off at the end."""
    whole = pcd(np.eye(3), "binary_compressed")
    begin = whole.index(b"binary_compressed\n") + len(b"binary_compressed\n")
    with pytest.raises(ValueError, match="the file ends before the sizes of its compressed points"):
        read(whole[: begin + 7])
    with pytest.raises(ValueError, match="are said to hold 144 bytes; the header's fields have 108"):
        read(pcd(np.ones((4, 3)), "binary_compressed").replace(b"POINTS 4", b"POINTS 3"))
    with pytest.raises(ValueError, match=r"the file ends after \d+ bytes of compressed points; expected \d+"):
        read(whole[:-1])
