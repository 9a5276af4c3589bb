"""Numbers in a scene: SI when bare, converted when they carry a unit."""

import math
import subprocess
import sys
from decimal import Decimal

import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic_core import PydanticCustomError

from haploop.launch.scene.number import si
from haploop.launch.scene.units import _UNITS, _exact, is_exotic
from helpers.scenes.least import mistakes, scene


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.15 N/mm", "N/m", 150.0),
        ("0.2 m / 4096", "m", 0.2 / 4096),
        ("200 / 4096 mm", "m", 0.2 / 4096),
        ("1/3 N/mm/2", "N/m", 1000.0 / 6.0),
        ("-60 mm", "m", -0.060),
        ("0.0008 N s/mm", "N s/m", 0.8),
        ("2 ms", "s", 0.002),
        ("28.7 µm", "m", 28.7e-6),
        ("3g", "kg", 0.003),
        ("1e1 kHz", "Hz", 10_000.0),
        ("90 deg", "rad", math.pi / 2),
        ("90 °", "rad", math.pi / 2),
    ],
)
def test_text_with_a_unit_is_the_same_float_as_the_si_number_to_the_last_bit(text, unit, value):
    assert si(unit).read(text) == value


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("2 ms", "ms is a time; a stiffness was expected, such as N/m."),
        ("3 N/m °", "N/m ° contains an angle and cannot be used for N/m."),
        ("5 Ns/mm", '"Ns/mm" is not a unit; leave a space between multiplied units.'),
        ("5", 'Text must carry a unit, such as "5 N/m"'),
        ("five N/m", 'It must be a number and its unit, such as "1 N/m" or "0.2 N/m / 4096".'),
        ("1e9999 N/m", '"e9999 N/m" is not a unit'),
        ("5 m**999999999", "It must be a number and its unit"),
        ("5 m**9**9**9", "It must be a number and its unit"),
        ("1e999 N/m", "It must be a finite number"),
        ("9**9**9**9 N/m", "It must be a number and its unit"),
        (True, "It must be a number in N/m, at least 0"),
        ([1.0], "It must be a number in N/m, at least 0"),
        (math.nan, "It must be a finite number of N/m."),
        (-math.inf, "It must be a finite number of N/m."),
        (10**400, "It must be a number that a float can hold."),
        (-1, "It must be at least 0 N/m."),
        ("-1 N/mm", "It must be at least 0 N/m."),
    ],
)
def test_what_is_no_usable_number_is_refused_with_the_reason(given, sentence):
    with pytest.raises(PydanticCustomError) as refusal:
        si("N/m", at_least=0).read(given)
    assert refusal.value.message().startswith(sentence)


@pytest.mark.parametrize(
    ("given", "unit", "meant"),
    [
        ("3 minits", "s", "minutes"),
        ("2 milimeter", "m", "millimetres"),
        ("2 newton metres per", "N/m", ""),
        ("3 zz", "s", ""),
    ],
)
def test_a_word_that_is_no_unit_is_told_with_the_nearest_unit_of_its_dimension_alone(given, unit, meant):
    with pytest.raises(PydanticCustomError) as refusal:
        si(unit).read(given)
    hint = f"did you mean {meant}?" if meant else "leave a space between multiplied units."
    assert refusal.value.message().endswith(f"is not a unit; {hint}")


@pytest.mark.parametrize("text", ["10 rad/s", "600 rpm"])
def test_an_angular_rate_is_not_taken_for_a_frequency(text):
    """pint alone takes 10 rad/s for 10 Hz and 60 rpm for 6.28 Hz."""
    [mistake] = mistakes(velocity={"cutoff": text})
    assert "contains an angle and cannot be used for Hz" in mistake


def test_a_rate_is_a_whole_number():
    assert scene(clock={"plant_rate": "20 kHz"}).clock.plant_rate == 20_000
    assert isinstance(scene(clock={"plant_rate": 20_000.0}).clock.plant_rate, int)
    [mistake] = mistakes(clock={"control_rate": 999.5})
    assert mistake.startswith("clock.control_rate is 999.5. It must be a whole number in Hz, at least 1")


def test_a_seed_is_not_rounded_to_a_float():
    assert scene(seed=2**63 - 1).seed == 2**63 - 1
    assert mistakes(seed=2**63) == ["seed is 9223372036854775808. It must be below 9.22337e+18."]


@settings(max_examples=40)
@given(st.text(max_size=30) | st.from_regex(r"-?[0-9.e]{1,6} ?[a-zA-Z/*^ ().0-9µ%°²-]{0,12}", fullmatch=True))
def test_any_text_is_a_number_or_a_sentence(text):
    try:
        said = si("m").read(text)
    except PydanticCustomError as refusal:
        said = refusal.message()
    assert said.endswith(".") if isinstance(said, str) else math.isfinite(said)


@pytest.mark.parametrize(
    ("given", "unit", "sentence"),
    [
        ("85 gr", "kg", "gr is the grain, 65 mg; write g."),
        ("85 gr cm^2", "kg m^2", "gr is the grain, 65 mg; write g."),
        ("85 mgr", "kg", "mgr is a thousandth of the grain, 65 ng; write mg."),
        ("1 ton", "kg", "ton is the short ton, 907 kg; write t, which is 1000 kg."),
        ("12 Nm", "N", "Nm is a torque or an energy; a force was expected, such as N."),
        ("12 mNm", "N/m", "mNm is a torque or an energy; a stiffness was expected, such as N/m."),
    ],
)
def test_a_name_that_is_another_unit_than_is_mostly_meant_by_it_is_refused(given, unit, sentence):
    with pytest.raises(PydanticCustomError) as refusal:
        si(unit).read(given)
    assert refusal.value.message() == sentence


def test_units_of_the_table_are_those_of_pint_to_the_last_digit():
    units = pint.UnitRegistry(non_int_type=Decimal)  # pyright: ignore[reportArgumentType]
    compound = ["N/mm", "mN s/m", "kg*m**2/s^2", "m s⁻²", "cm²/ms", "m/s^2/Hz^0.5"]
    for name in [*_UNITS, *compound]:
        exact = _exact(name)
        assert exact, name
        base = units.Quantity(Decimal(1), units.parse_units(name.replace("Nm", "N*m"))).to_base_units()
        powers = dict(base.unit_items())
        assert exact[0] == tuple(powers.get(of, 0) for of in ("kilogram", "meter", "second", "radian")), name
        assert exact[1] == base.magnitude, name


@pytest.mark.parametrize("text", ["3 furlong/fortnight", "5 inch/s", "1 km/hour", "2 kHz^0.5"])
def test_what_the_table_does_not_have_is_told_to_need_the_library_of_units(text):
    assert is_exotic(text)
    assert not is_exotic("0.15 N/mm")
    assert not is_exotic("five N/m")
    assert not is_exotic("damping")


def test_the_library_of_units_is_loaded_only_for_a_unit_that_the_table_does_not_have():
    code = (
        "import sys; from haploop.launch.scene.number import si; si('m').read(1.0); si('m').read('1 mm');"
        "assert 'pint' not in sys.modules;"
        "si('m').read('1 inch'); assert 'pint' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
