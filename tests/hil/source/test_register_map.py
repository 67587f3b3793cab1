"""Register maps: what they accept, how they refuse, how they group reads, and what registers mean."""

from __future__ import annotations

import math
import re
import struct
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bristle.cli.app import run
from hil import Point, RegisterMap, Ring, WriteMap, decode, describe_register_map, encode
from recordings import BadInput

HEAD = 'kind = "read"\nname = "m"\n'
A = '[[points]]\nname = "a"\ntable = "input"\naddress = 0\ntype = "float32"\n'
ORDERS = ("ABCD", "CDAB", "BADC", "DCBA")
FORMATS = {"int16": ">h", "uint16": ">H", "int32": ">i", "uint32": ">I", "float32": ">f", "float64": ">d"}


def point(**keys):
    return Point(**{"name": "p", "table": "holding", "address": 0, "type": "uint16"} | keys)


def load(tmp_path, text, kind=RegisterMap, name="map.toml"):
    path = tmp_path / name
    path.write_text(text)
    return kind.load(path)


@pytest.mark.parametrize("order", ORDERS)
def test_the_byte_orders_are_those_of_the_vendors(order):
    # 0x41424344 is 12.141422271728516 as a float; the letters of an order are the bytes as they come over the wire
    words = list(struct.unpack(">2H", bytes({"A": 0x41, "B": 0x42, "C": 0x43, "D": 0x44}[letter] for letter in order)))
    assert decode(point(type="float32", byte_order=order), words).value == 12.141422271728516
    assert decode(point(type="uint32", byte_order=order), words).value == 0x41424344
    assert encode(point(type="uint32", byte_order=order), 0x41424344) == words


def test_the_byte_orders_of_one_and_four_registers():
    assert encode(point(byte_order="BADC"), 0x0102) == [0x0201]
    assert encode(point(byte_order="CDAB"), 0x0102) == [0x0102]
    whole = list(struct.unpack(">4H", struct.pack(">d", math.pi)))
    swapped = [(w & 0xFF) << 8 | w >> 8 for w in whole]
    assert encode(point(type="float64"), math.pi) == whole
    assert encode(point(type="float64", byte_order="CDAB"), math.pi) == whole[::-1]
    assert encode(point(type="float64", byte_order="BADC"), math.pi) == swapped
    assert encode(point(type="float64", byte_order="DCBA"), math.pi) == swapped[::-1]


@given(st.sampled_from(sorted(FORMATS)), st.sampled_from(ORDERS), st.binary(min_size=8, max_size=8))
def test_what_can_be_encoded_comes_back(kind, order, noise):
    raw = struct.unpack(FORMATS[kind], noise[: struct.calcsize(FORMATS[kind])])[0]
    place = point(type=kind, byte_order=order, scale=0.5, offset=-3.0)
    value = raw * 0.5 - 3.0
    if math.isfinite(value):
        again = decode(place, encode(place, value)).value
        assert again == pytest.approx(value, rel=1e-6, abs=1e-12)
    else:
        with pytest.raises(BadInput):
            encode(place, value)


@given(st.sampled_from(sorted(FORMATS)), st.sampled_from(ORDERS), st.lists(st.integers(-9, 70000), max_size=6))
def test_whatever_the_registers_decoding_gives_a_value_in_range_or_a_reason(kind, order, registers):
    place = point(type=kind, byte_order=order, valid_range=(-5.0, 1000.0), invalid=(7,))
    decoded = decode(place, registers)
    assert (decoded.value is None) != (decoded.reason is None)
    assert decoded.value is None or -5.0 <= decoded.value <= 1000.0


@pytest.mark.parametrize(
    ("keys", "registers", "reason"),
    [
        ({"type": "int16", "invalid": (0x8000,)}, [0x8000], "means invalid"),
        ({"type": "int16", "invalid": (-32768,)}, [0x8000], "means invalid"),
        ({"type": "int16", "invalid": (0x7FFF, 0x8000)}, [0x7FFF], "32767 means invalid"),
        ({"type": "float32", "invalid": (-9999.9,)}, [0xC61C, 0x3F9A], "means invalid"),
        ({"type": "float32"}, [0x7FC0, 0], "not finite"),
        ({"type": "float32"}, [0xFF80, 0], "not finite"),
        ({"type": "uint16", "scale": 0.1, "unit": "%", "valid_range": (0, 100)}, [1001], "100.1 outside 0 to 100 %"),
        ({"type": "float32"}, [0x3F80], "1 registers instead of 2"),
        ({"type": "uint16"}, [65536], "outside 0..65535"),
        ({"type": "uint16"}, [-1], "outside 0..65535"),
        ({"type": "bit", "table": "coil"}, [2], "outside 0..1"),
    ],
)
def test_a_value_that_is_not_certain_is_none_with_a_reason(keys, registers, reason):
    decoded = decode(point(**keys), registers)
    assert decoded.value is None
    assert reason in decoded.reason


@pytest.mark.parametrize(
    ("keys", "value", "word"),
    [
        ({"type": "int16"}, 32768.0, "cannot hold"),
        ({"type": "uint16"}, -1.0, "cannot hold"),
        ({"type": "float32"}, 1e39, "cannot hold"),
        ({"type": "uint16"}, math.nan, "finite"),
        ({"type": "float64"}, math.inf, "finite"),
        ({"valid_range": (0.0, 1.0), "unit": "%"}, 1.5, "allowed is 0 to 1 %"),
        ({"type": "int16", "invalid": (0x8000,)}, -32768.0, "would read as bad"),
        ({"type": "bit", "table": "coil"}, 2.0, "cannot hold"),
    ],
)
def test_what_would_not_read_back_as_good_is_not_encoded(keys, value, word):
    with pytest.raises(BadInput, match=word) as refusal:
        encode(point(**keys), value)
    assert "'p'" in str(refusal.value)


def test_bits_of_a_register_and_of_a_bit_table():
    flag = point(type="bit", bit=3)
    assert [decode(flag, [word]).value for word in (0b1000, 0b0111)] == [1.0, 0.0]
    assert encode(flag, 1.0) == [8]
    assert decode(point(type="bit", bit=8, byte_order="BADC"), [1]).value == 1.0
    assert decode(point(table="discrete", type="bit"), [True]).value == 1.0
    assert encode(point(table="coil", type="bit"), 1.0) == [1]


def test_reads_run_across_small_holes_and_stop_at_large_ones_and_at_the_limit():
    def at(*addresses, **more):
        points = [point(name=f"p{n}", address=n) for n in addresses]
        return [(b.address, b.count) for b in RegisterMap(name="m", points=points, **more).reads()]

    assert at(0, 9) == [(0, 10)]
    assert at(0, 10) == [(0, 1), (10, 1)]
    assert at(0, 1, max_hole=0) == [(0, 2)]
    assert at(0, 2, max_hole=0) == [(0, 1), (2, 1)]
    assert at(*range(0, 250, 2)) == [(0, 125), (126, 123)]
    assert at(*range(20), max_read=8) == [(0, 8), (8, 8), (16, 4)]


def test_reads_are_per_unit_and_table_and_bits_have_their_own_limit():
    points = [point(name="h", address=5), point(name="i", table="input", address=6)]
    points += [point(name="u", address=6, unit_id=2)]
    points += [point(name=f"d{n}", table="discrete", type="bit", address=n) for n in range(0, 2004, 4)]
    blocks = RegisterMap(name="m", points=points).reads()
    assert [(b.unit_id, b.function_code, b.address, b.count) for b in blocks] == [
        (1, 2, 0, 1997), (1, 2, 2000, 1), (1, 3, 5, 1), (1, 4, 6, 1), (2, 3, 6, 1),
    ]  # fmt: skip


@given(st.sets(st.integers(0, 400), min_size=1, max_size=60), st.integers(0, 20), st.integers(4, 125))
def test_every_point_is_read_once_whole_and_within_the_limits(slots, max_hole, max_read):
    points = [point(name=f"p{n}", address=4 * n, type="float64") for n in slots]
    register_map = RegisterMap(name="m", points=points, max_hole=max_hole, max_read=max_read)
    blocks = register_map.reads()
    assert sorted(p.name for b in blocks for p in b.points) == sorted(p.name for p in points)
    memory = list(range(2000))
    for block in blocks:
        assert block.count <= max_read
        reply = memory[block.address : block.address + block.count]
        for one in block.points:
            assert block.registers_of(one, reply) == memory[one.address : one.end]


@pytest.mark.parametrize(
    ("text", "place", "remedy"),
    [
        (HEAD + A + "adress = 3\n", "points[0].adress ('a'): unknown key", "did you mean 'address'"),
        (HEAD + "hartbeat = 'a'\n" + A, "hartbeat: unknown key", "did you mean 'heartbeat'"),
        (HEAD + A + A.replace('"a"', '"b"').replace("0", "1"), "points[1].address: 'b' overlaps 'a'", "overlap = true"),
        (HEAD + A + A.replace("0", "8"), "points[1].name: 'a' is already", ""),
        (HEAD + A.replace("0", "-1"), "points[0].address ('a')", "found -1"),
        (HEAD + A.replace("0", "65535"), "points[0] ('a')", "runs past the last address"),
        (HEAD + A.replace("float32", "float16"), "points[0].type ('a')", "'int16'"),
        (HEAD + A + "scale = 0\n", "points[0] ('a')", "not 0"),
        (HEAD + A + "valid_range = [2, 1]\n", "points[0] ('a')", "[lowest, highest]"),
        (HEAD + A + "unit_id = 300\n", "points[0].unit_id ('a')", "247"),
        (HEAD + A.replace("float32", "bit"), "points[0] ('a')", "bit = 0..15"),
        (HEAD + A.replace("input", "coil"), "points[0] ('a')", "single bits"),
        (HEAD + A.replace('"a"', '"position"') + "unit = 'V'\n", "points[0] ('position')", "allowed for position"),
        (HEAD + A.replace("float32", "int16") + "invalid = [70000]\n", "points[0] ('a')", "70000 is not a raw value"),
        (HEAD + "heartbeat = 'b'\n" + A, "heartbeat: there is no point named 'b'", "name one"),
        (HEAD + "max_read = 1\n" + A, "max_read", "less than the 2 registers of 'a'"),
        (HEAD + A + "[ring]\naddress = 1\nsamples = 4\npoints = ['a']\n", "ring.address", "overlaps point 'a'"),
        (HEAD + A + "[ring]\naddress = 10\nsamples = 4\npoints = ['b']\n", "ring.points[0]", "no point named 'b'"),
        (HEAD + A + "[ring]\naddress = 10\nsamples = 16384\npoints = ['a']\n", "ring.samples", "past address 65535"),
        (HEAD, "points", "give it"),
        (HEAD + "points = []\n", "points", "at least one"),
        (HEAD + "points = ['a']\n", "points[0]", ""),
        (HEAD + A.replace("float32", "int16") + "invalid = [inf]\n", "points[0] ('a')", "inf is not a raw value"),
        ("kind = 'red'\n", "kind", "'read' or 'write'"),
        ("kind = ['read']\n", "kind", "'read' or 'write'"),
        ("kind = 'write'\nname = 'm'\n" + A, "a map for writing", "a map for reading"),
        ("name = \n", "not TOML", "line 1"),
    ],
)
def test_a_mistake_in_a_map_is_one_line_with_its_place(tmp_path, text, place, remedy):
    with pytest.raises(BadInput) as refusal:
        load(tmp_path, text)
    message = str(refusal.value)
    assert message.startswith(str(tmp_path / "map.toml"))
    assert place in message
    assert remedy in message
    assert "\n" not in message


def test_several_mistakes_are_counted(tmp_path):
    with pytest.raises(BadInput, match=r"\(and 2 more mistakes\)"):
        load(tmp_path, HEAD + A + "x = 1\ny = 2\nz = 3\n")


def test_registers_may_be_shared_on_purpose_and_bits_of_one_register_always(tmp_path):
    flags = "".join(
        f"[[points]]\nname = 'f{n}'\ntable = 'input'\naddress = 9\ntype = 'bit'\nbit = {n}\n" for n in (0, 7)
    )
    word = "[[points]]\nname = 'w'\ntable = 'input'\naddress = 9\ntype = 'uint16'\n"
    assert len(load(tmp_path, HEAD + flags).points) == 2
    with pytest.raises(BadInput, match="overlaps"):
        load(tmp_path, HEAD + flags + word)
    assert load(tmp_path, HEAD + flags + word + "overlap = true\n").reads()[0].count == 1
    with pytest.raises(BadInput, match="overlaps"):
        load(tmp_path, HEAD + flags + flags.replace("'f", "'g"))


@pytest.mark.parametrize("where", ["nowhere.toml", "."])
def test_a_map_that_is_not_there_names_the_shipped_ones_or_the_need(where):
    with pytest.raises(BadInput, match=r"damadics|register map file"):
        RegisterMap.load(where)


def test_a_file_that_is_not_text_is_refused(tmp_path):
    (tmp_path / "m.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadInput, match="not text"):
        RegisterMap.load(tmp_path / "m.toml")


def test_a_write_map_is_a_kind_of_its_own(tmp_path):
    head, target = 'kind = "write"\nname = "w"\n', A.replace("input", "holding")
    assert load(tmp_path, head + target, WriteMap).point("a").address == 0
    with pytest.raises(BadInput, match="a map for writing"):
        load(tmp_path, head + target, RegisterMap)
    with pytest.raises(BadInput, match="a map for reading"):
        load(tmp_path, HEAD + target, WriteMap)
    with pytest.raises(BadInput, match="cannot be written"):
        load(tmp_path, head + A, WriteMap)
    with pytest.raises(BadInput, match="without the other 15"):
        load(tmp_path, head + target.replace("float32", "bit") + "bit = 1\n", WriteMap)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_table_of_points_is_a_map(tmp_path, separator):
    rows = [
        "name,table,address,type,scale,offset,unit,valid_min,valid_max,invalid,unit_id",
        "setpoint,input,0,uint16,0.01,,%,0,100,65535,",
        "position,input,0x01,int16,3.81e-6,,m,-0.002,,0x8000 0x7FFF,2",
        "flag,coil,4,bit,,,,,,,",
    ]
    path = tmp_path / "points.csv"
    path.write_text("\n".join(rows).replace(",", separator))
    made = RegisterMap.from_csv(path)
    assert made.name == "points"
    assert made == RegisterMap.load(path)
    assert made.point("setpoint").valid_range == (0.0, 100.0)
    position = made.point("position")
    assert (position.address, position.invalid, position.unit_id) == (1, (0x8000, 0x7FFF), 2)
    assert position.valid_range == (-0.002, math.inf)
    assert made.point("flag") == Point(name="flag", table="coil", address=4, type="bit")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name,table,adress,type\na,input,0,int16\n", "did you mean 'address'"),
        ("name,table,address,type\na,input,zero,int16\n", "points[0].address ('a')"),
        ("name,table,address,type\na,input,0,int16,9\n", "line 2: more cells"),
        ("name,table,address,type\na,input,0,int16\nb,input,0,int16\n", "'b' overlaps 'a'"),
        ('name,table,address,type\na,input,"0,int16\n', "not CSV"),
        ("", "points"),
    ],
)
def test_a_mistake_in_a_table_of_points_names_its_place(tmp_path, text, words):
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(BadInput) as refusal:
        RegisterMap.from_csv(path)
    assert words in str(refusal.value)


@pytest.mark.parametrize("name", ["damadics", "positioner-int16"])
def test_the_shipped_reading_maps_load_by_name(name):
    shipped = RegisterMap.load(name)
    assert shipped.heartbeat in {p.name for p in shipped.points}
    assert shipped.point("position").unit == "m"


def test_the_shipped_actuator_map_is_read_with_one_request_and_never_writes():
    assert [(b.address, b.count) for b in RegisterMap.load("damadics").reads()] == [(0, 34)]
    assert {p.table for p in RegisterMap.load("damadics").points} == {"input"}
    assert WriteMap.load("damadics-write").point("advance").type == "uint16"


def test_an_unknown_point_lists_the_known_ones():
    with pytest.raises(BadInput, match="setpoint, position"):
        RegisterMap.load("positioner-int16").point("postion")


def test_a_map_on_another_unit():
    moved = RegisterMap.load("damadics").on_unit(7)
    assert {b.unit_id for b in moved.reads()} == {7}


def test_the_ring_reads_whole_samples_up_to_its_end_and_recognises_other_samples():
    shipped = RegisterMap.load("damadics")
    ring, points = shipped.ring, shipped.points
    size = ring.slot_size(points)
    assert ring.read_for(points, 0, 100) == (1000, 15 * size, 15)
    assert ring.read_for(points, 2040, 100) == (1000 + 2040 * size, 8 * size, 8)
    assert ring.read_for(points, 2048, 3) == (1000, 3 * size, 3)
    half = [0x3F00, 0]
    slots = [0, 4096, *half * 3, 0, 1, *half * 3]
    first, second = ring.decode(points, 4096, slots)
    assert first["position"].value == 0.5 * 0.0381
    assert second is None


def test_a_map_is_shown_as_a_table_with_its_requests():
    lines = describe_register_map("positioner-int16").splitlines()
    position = next(line for line in lines if " position " in line)
    assert position.split()[:8] == ["1", "input", "1", "int16", "ABCD", "position", "raw", "x"]
    assert lines[-1] == "request 2: unit 1, function 4, input 0 to 7 (8)"
    assert "holding   20 " in describe_register_map("damadics-write")
    assert describe_register_map("damadics").splitlines()[-1].startswith("ring: the last 2048 samples")


def test_showing_a_map_checks_it(tmp_path):
    (tmp_path / "m.toml").write_text(HEAD + A + A.replace('"a"', '"b"'))
    with pytest.raises(BadInput, match="overlaps"):
        describe_register_map(tmp_path / "m.toml")


def test_the_show_command_prints_a_map_and_draws_it_as_a_page(tmp_path, capsys):
    (tmp_path / "m.toml").write_text(HEAD + A + 'description = "a < b"\n')
    assert run(["show", str(tmp_path / "m.toml"), "--plot", str(tmp_path / "m.html")]) == 0
    assert "1 point without overlap" in capsys.readouterr().out
    assert "a &lt; b" in (tmp_path / "m.html").read_text()
    (tmp_path / "m.toml").write_text(HEAD + A + "scael = 2\n")
    assert run(["show", str(tmp_path / "m.toml")]) == 2
    assert "did you mean 'scale'" in capsys.readouterr().err


DOCUMENT = Path(__file__).resolve().parents[3] / "docs" / "register-maps.md"


def test_the_examples_of_the_documentation_load(tmp_path):
    examples = re.findall(r"^```(toml|csv)\n(.*?)^```", DOCUMENT.read_text(), re.MULTILINE | re.DOTALL)
    assert {kind for kind, _ in examples} == {"toml", "csv"}
    for k, (suffix, text) in enumerate(examples):
        kind = WriteMap if 'kind = "write"' in text else RegisterMap
        assert load(tmp_path, text, kind, f"example{k}.{suffix}").points


def test_the_documentation_has_every_key():
    text = DOCUMENT.read_text()
    keys = {*Point.model_fields, *RegisterMap.model_fields, *Ring.model_fields}
    assert [key for key in sorted(keys) if f"`{key}`" not in text] == []


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("m.csv", "name,table,address,address,type\na,input,1,2,uint16\n", "column 'address': it is there twice"),
        ("m.csv", 'name,"table,address,type\na,input,1,uint16\n', "not CSV"),
        ("m.csv", "name,table,address,type\na,input,1_0,uint16\n", "address"),
        ("m.csv", "name,table,address,type\na,input,\u0661\u0662,uint16\n", "address"),
        ("m.toml", "a = " + "[" * 5000, "nested 5000 times"),
        ("m.toml", "a = " + "9" * 10_000, "it is not TOML"),
        ("m.csv", "name,table,address,type\n" + "a,input,1,uint16\n" * 5000, "points"),
    ],
)
def test_a_hostile_map_is_bad_input(tmp_path, name, text, words):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match=words):
        RegisterMap.load(path)
