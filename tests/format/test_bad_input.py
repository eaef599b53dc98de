"""Every mistake in a case file is one clear error with file, line, what is allowed and the nearest guess."""

import os

import pytest
from jsonschema import Draft202012Validator

from surfacechem.documents import document
from surfacechem.errors import InputError, nearest
from surfacechem.format import load, load_text
from surfacechem.format.schema import schema

pytestmark = pytest.mark.around

GOOD = """\
T_0: 300 K
bodies:
  lower: {temperature: T, C: 1 kJ/m^2/K}
  upper: {temperature: T, C: 1 kJ/m^2/K}
interface:
  temperature: T
  sites: 1e18 1/m^2
  potential:
    - bond-energy: {K_0: 300 J/m^2}
  friction:
    - coulomb: {mu: {value: 0.3, times: [power: {exponent: -2}]}}
  bonding:
    - relaxation: {tau: 0.5 s}
heat:
  - conductance: {between: [lower, surroundings], h: 12 W/m^2/K}
surroundings: {temperature: 300 K}
loading: {v: 0.1 m/s, p: 1 kPa}
initial: {phi: 0, T: 300 K}
run: {until: 5 s}
reference: bonding
"""

SCHEMA = Draft202012Validator(schema())
BODY_KEYS = "Known: C, E, H, capacity, conduction, stiffness, temperature."

MISTAKES = [
    # what to replace, by what, the message
    (
        "{temperature: T, C:",
        "{temperature: T, Cc:",
        f"3: bodies.lower: unknown key 'Cc'. Did you mean 'C'? {BODY_KEYS}",
    ),
    ("1 kJ/m^2/K}\n  up", "1 kJ/m^2}\n  up", "3: bodies.lower.C: 1 kJ/m^2 is an energy per area; C needs a heat"),
    ("C: 1 kJ/m^2/K}\n  up", "C: -1}\n  up", "3: bodies.lower.C: C = -1 is outside its range: > 0."),
    ("C: 1 kJ/m^2/K}\n  up", "C: .nan}\n  up", "3: bodies.lower.C: C must be finite, got 'nan'."),
    ("lower: {", "lower: {E: 1e308, H: 1 mm, ", "3: bodies.lower.E: a stiffness of inf Pa/m is beyond the range of nu"),
    ("lower: {", "lower: {stiffness: 1e-320, ", "3: bodies.lower.stiffness: a stiffness of 9.99989e-321 Pa/m is bey"),
    (
        "}\nint",
        ", stiffness: 1}\nmechanics: {normal: {k: 0}}\nint",
        "5: mechanics.normal: the stiffness has two roles: ",
    ),
    ("C: 1 kJ/m^2/K}\n  up", "capacity: cubic}\n  up", "3: bodies.lower.capacity: no capacity 'cubic'. Known: const"),
    ("C: 1 kJ/m^2/K}\n  up", "capacity: constant}\n  up", "3: bodies.lower: lower needs `C`: heat capacity per"),
    ("  upper:", "  lower:", "4: the key 'lower' is given twice, first in line 3."),
    ("  upper:", "  interface:", "4: bodies.interface: 'interface' cannot name a body"),
    ("  upper: {temperature: T, C: 1 kJ/m^2/K}\n", "", "2: bodies: exactly two bodies are needed, not 1"),
    ("  upper:", "  uper: {}\n  upper:", "2: bodies: exactly two bodies are needed, not 3 (lower, uper, upper); the"),
    ("upper: {temperature: T,", "upper: {", "4: bodies.upper: upper needs `temperature`: a name such as T, or a val"),
    ("upper: {temperature: T,", "upper: {temperature: -5,", "4: bodies.upper.temperature: -5 K is not an absolute t"),
    ("upper: {temperature: T,", "upper: {temperature: 25 C,", "4: bodies.upper.temperature: 25 C is an electric char"),
    ("upper: {temperature: T,", "upper: {temperature: mu,", "4: bodies.upper.temperature: 'mu' cannot name a temper"),
    ("upper: {temperature: T,", "upper: {temperature: T_ä,", "'T_ä' cannot name a temperature: use T, followed by let"),
    ("upper: {temperature: T,", "upper: {temperature: T_1,", "4: bodies.upper.temperature: 'T_1' is temperature of"),
    ("bodies:", "bodys:", "2: unknown key 'bodys'. Did you mean 'bodies'? Known: T_0, bodies,"),
    ("heat:", "friction: []\nheat:", "14: unknown key 'friction'. It belongs under `interface`; see"),
    ("  bonding:", "  loading: {}\n  bonding:", "12: interface: unknown key 'loading'. It belongs at the top level;"),
    ("- bond-energy: {K_0", "- bond-enrgy: {K_0", "9: interface.potential.bond-enrgy: no potential law 'bond-enrgy'. "),
    ("- bond-energy: {K_0: 300 J/m^2}", "- []", "9: interface.potential[1]: a law is one entry, `name: {parameters}`,"),
    ("- bond-energy: {K_0: 300 J/m^2}", "- {value: 1, times: 2}", "`name: {parameters}`, not several: value, times."),
    ("- bond-energy: {K_0", "bond-energy: {K_0", "8: interface.potential: this must be a list"),
    ("{tau: 0.5 s}", "{}", "13: interface.bonding.relaxation: relaxation needs `tau`: relaxation time [s]."),
    ("relaxation: {tau: 0.5 s}", "relaxation", "13: interface.bonding.relaxation: relaxation needs `tau`"),
    ("times: [power", "times: [powr", "11: interface.friction.coulomb.mu.times.powr: no factor law 'powr'. Did you"),
    ("times: [power: {e", "time: [power: {e", "11: interface.friction.coulomb.mu: unknown key 'time'. Did you mean"),
    ("[power: {exponent: -2}]", "[power: {exponent: -2, of: w}]", "11: interface.friction.coulomb.mu.times.power.of:"),
    ("exponent: -2", "exponent: {value: 1}", "power.exponent: exponent cannot vary; give it a value."),
    ("sites: 1e18 1/m^2", "sites: {lower: 1e18}", "7: interface.sites: the sites of upper are missing"),
    ("  sites:", "  partition: 0.5\n  sites:", "7: interface.partition: an interface with a temperature divides it"),
    ("[lower, surroundings]", "[lowr, surroundings]", "15: heat.conductance.between: no end 'lowr'. Did you mean 'l"),
    ("[lower, surroundings]", "[lower, sky]", "no end 'sky'. Known: interface, lower, surroundings, upper."),
    ("T_0: 300 K", "T_0: 300,5 K", "1: T_0: '300,5 K' is not a number with a unit; T_0 needs a temperature [K]. Deci"),
    ("{value: 0.3, ", "{val: 0.3, ", "11: interface.friction.coulomb.mu: unknown key 'val'. Did you mean 'value'?"),
    ("{value: 0.3, ", "{", "11: interface.friction.coulomb.mu: mu needs `value`: a pure number."),
    ("[lower, surroundings]", "[lower, lower]", "15: heat.conductance.between: a heat path needs two different ends"),
    ("[lower, surroundings]", "[lower]", "15: heat.conductance.between: between needs 2 entries, got 1."),
    ("[lower, surroundings]", "lower", "15: heat.conductance.between: this must be a list, not 'lower'."),
    ("surroundings: {temperature: 300 K}\n", "", "15: heat.conductance.between: the surroundings have no temperature."),
    ("{temperature: 300 K}", "20 degC", "16: surroundings: this must be a mapping, `{temperature: 20 degC}`, not '20"),
    ("{temperature: 300 K}", "{temperature: 0 K}", "16: surroundings.temperature: 0 K is not an absolute temperature"),
    ("loading: {v:", "loading: {w:", "17: loading: unknown key 'w'. Did you mean 'w_n'? Known: F_n, F_t, F_t2, J_c"),
    ("v: 0.1 m/s", "g_n: 5 nm/s", "g_n needs a length [m]. To change it in time, write `{ramp: {rate: 5 nm/s}}`."),
    ("v: 0.1 m/s", "v: {rampe: {rate: 1}}", "17: loading.v: no loading law 'rampe'. Did you mean 'ramp'?"),
    ("v: 0.1 m/s", "v: {ramp: {rate: 1 m/s}}", "17: loading.v.ramp.rate: 1 m/s is a velocity; rate needs an accele"),
    ("v: 0.1 m/s", "v: {table: {times: [0, 1], values: [0]}}", "17: loading.v.table: a table needs as many times (2)"),
    ("v: 0.1 m/s", "v: {table: {times: [0, 1 m], values: [0]}}", "17: loading.v.table.times[2]: 1 m is a length; an e"),
    ("v: 0.1 m/s", "v: 0.1 m/s, T: 3 K", "18: initial.T: T is prescribed under `loading`, so it has no initial value"),
    ("phi: 0,", "phi: 2,", "18: initial.phi: phi = 2 is outside its range: >= 0 and <= 1."),
    ("phi: 0,", "psi: 0,", "18: initial: phi evolves but has no initial value. Add `phi:` under `initial`; 'psi' ther"),
    ("phi: 0,", "phi: 0, gn: 0,", "18: initial.gn: nothing that evolves is called 'gn'. Known: T, phi."),
    ("phi: 0,", "phi: 0, T_1: 300,", "18: initial.T_1: T_1 is T in this case; give `T` instead."),
    ("  - conductance: {", "  conductance: {", "14: heat: this must be a list, for example `- conductance: {between:"),
    ("surroundings: {temperature: 300 K}", "surroundings: {}", "16: surroundings: the section surroundings needs `tem"),
    ("run: {until: 5 s}", "title:\nrun: {until: 5 s}", "19: title: title is empty; give a text, or leave the key"),
    ("run: {until: 5 s}", "run: {times: [1 m]}", "19: run.times[1]: 1 m is a length; an entry of times needs a t"),
    ("reference: bonding", "reference: []", "20: reference: an exact solution is given by its name, for example `ref"),
    ("reference: bonding", "reference: bonding\nsweep: {}", "21: sweep: a sweep needs `over` or `sample`: values of p"),
    ("reference: bonding", "reference: bonding\nsweep: {over: {}}", "example `over: {loading.f.ramp.rate: {from: 1 pN"),
    ("{until: 5 s}", "{until: {f: 1 pN}}", "19: run.until: where a load is reached, runs of a sweep end by `sweep.unt"),
    ("{until: 5 s}", "{until: stedy}", "19: run.until: until is a number with a unit or `steady`, not 'stedy'."),
    ("{until: 5 s}", "{outputs: 5}", "19: run: the run needs an end. Add `until: 1 s`, or a list of `times`."),
    ("{until: 5 s}", "{until: 5 s, outputs: [1 s]}", "19: run.outputs: outputs are a number, `outputs: 201`; a list"),
    ("{until: 5 s}", "{until: 5 s, outputs: 2.5}", "19: run.outputs: outputs must be a whole number, got 2.5."),
    ("{until: 5 s}", "{until: 5 s, outputs: 1e99}", "19: run.outputs: outputs = 1e+99 is outside its range: >= 2 an"),
    ("{until: 5 s}", "{until: 5 s, spacing: log}", "19: run.spacing: no spacing 'log'. Did you mean 'logarithmic'?"),
    ("{until: 5 s}", "{until: 5 s, spacing: logarithmic}", "19: run.spacing: logarithmic spacing needs `first`"),
    ("{until: 5 s}", "{until: 5 s, first: 1}", "19: run.first: `first` belongs to `spacing: logarithmic`."),
    ("{until: 5 s}", "{until: 5 s, times: [1]}", "19: run.until: the output times have two roles: give `times` or `u"),
    ("{until: 5 s}", "{times: [2, 1]}", "19: run.times: output times must increase from each to the next."),
    ("{until: 5 s}", "{times: []}", "19: run.times: at least one time after 0 is needed."),
    ("{until: 5 s}", "{until: 5, accuracy: 1e-8, rtol: 1e-8}", "19: run.accuracy: the tolerance has two roles: give `"),
    ("{until: 5 s}", "{until: 5, rtol: 1e-20}", "19: run.rtol: rtol = 1e-20 is outside its range: >= 1e-13 and <= 0.1"),
    ("{until: 5 s}", "{until: 5, solver: radua}", "19: run.solver: no solver 'radua'. Did you mean 'radau'? Known: "),
    ("{until: 5 s}", "5 s", "19: run: this must be a mapping with the keys until, outputs,"),
    ("reference: bonding", "reference: bondin", "20: reference: no exact solution 'bondin'. Did you mean 'bonding'?"),
    ("reference: bonding", "reference: {name: bonding, tao: 1}", "20: reference: unknown key 'tao'. Did you mean '"),
    ("reference: bonding", "reference: {tau: 1}", "20: reference: the exact solution needs a `name`."),
    ("  bonding:", "  mechanism: nothing\n  bonding:", "12: interface.mechanism: no mechanism file nothing.yaml"),
    ("run: {", "\trun: {", "19: not YAML: while scanning for the next token, found character '\\t' that cannot sta"),
    ("  sites: 1e18", "  sites:1e18", "7: not YAML: while scanning a simple key, could not find expected ':'."),
    ("run: {until: 5 s}", "run: {until: 5 s", "20: not YAML: while parsing a flow mapping, expected ',' or '}', bu"),
    ("run: {until: 5 s}\n", "", "1: the case needs `run`: times, accuracy, solver, for example `run: {until: 5 s}`."),
    ("run: {", "run: !!python/name:os.system {", "19: a tag (tag:yaml.org,2002:python/name:os.system), which is not"),
    ("T_0: 300 K", "T_0: &a [*a]", "1: the alias *a has no anchor before it."),
    ("T_0: 300 K", "--- 1\n---", "2: more than one document."),
]


def _read(text):
    case = load_text(text, file="a.yaml")
    return case.system(), case.run


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES, ids=[f"{new!r:.40}" for _, new, _ in MISTAKES])
def test_message(old, new, message):
    assert old in GOOD
    with pytest.raises(InputError) as error:
        _read(GOOD.replace(old, new, 1))
    shown = str(error.value)
    assert message in shown
    assert shown.startswith("a.yaml:")
    assert "\n" not in shown
    if "unknown key" in message:
        assert not SCHEMA.is_valid(document.parse(GOOD.replace(old, new, 1)).plain())


def test_the_good_case_is_good():
    assert load_text(GOOD).system().warnings == ()


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("bodies.lower.Cc=2", f"override: bodies.lower: unknown key 'Cc'. Did you mean 'C'? {BODY_KEYS}"),
        ("bodys.lower.C=2", "override: unknown key 'bodys'. Did you mean 'bodies'? Known: T_0, bodies,"),
        ("bodies.lower.C=3 nm", "override: bodies.lower.C: 3 nm is a length; C needs a heat capacity per area [J/("),
        ("interface.potential.bond-enrgy.K_0=1", "nothing is called 'bond-enrgy' in interface.potential. Did you mean"),
        ("interface.potential.bond-energy[2].K_0=1", "nothing is called 'bond-energy[2]' in interface.potential. Did"),
        ("run.times=[1, 2]", "override: run.times: the output times have two roles: give `times` or `until`."),
        ("run.until.now=3", "override: run.until.now: run.until is a value, not a mapping."),
        ("run.until=", "run: the run needs an end. Add `until: 1 s`, or a list of `times`."),
        ("run.outputs=", "override: run.outputs: there is no 'outputs' to remove. Known: until."),
        ("initial.t=null", "override: initial.t: there is no 't' to remove. Did you mean 'T'? Known: T, phi."),
        ("loading.v.level=", "override: loading.v.level: loading.v is a value, not a mapping."),
        ("interface.friction.coulom=", "nothing is called 'coulom' in interface.friction. Did you mean 'coulomb'?"),
        ("run.until={", "override: run.until: not YAML: while parsing a flow"),
        ("run.until", "override: 'run.until' is not of the form path=value, for example `run.until=5 s`."),
        ("=", "override: '=' is not of the form path=value"),
    ],
)
def test_message_of_an_override(override, message):
    with pytest.raises(InputError) as error:
        load_text(GOOD, overrides=[override])
    assert message in str(error.value)


BOMB = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} [{', '.join([f'*{chr(97 + i)}'] * 9)}]\n" for i in range(12)
)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "{}: the file is empty."),
        (b"# only a comment\n", "{}: the file is empty."),
        (b"- 1\n- 2\n", "{}:1: this must be a mapping with the keys title, source,"),
        (b"just text", "{}:1: this must be a mapping with the keys title, source,"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "{}: no text in UTF-8; cases are YAML files"),
        (b"title: a\x00b\n", "{}:1: a control character, which YAML does not allow."),
        (b"x" * (document.LIMITS.largest + 1), "{}: larger than 1000000 bytes."),
        (b"[" * 100_000, "{}:1: nested deeper than 24 levels."),
        (b"a: [" + b"1, " * (document.LIMITS.most + 1) + b"]", "{}:1: more than 20000 values."),
        (b"run: {times: [" + b"1, " * (document.LIMITS.most + 1) + b"]}", "; of outputs give a number, `outputs: N`."),
        (BOMB.encode(), "aliases repeat more than 20000 values."),
        (b"%YAML 1.9\n---\na: 1", "{}: not YAML: version minor part"),
    ],
)
def test_files_that_are_no_cases(tmp_path, content, message):
    path = tmp_path / "bad.yaml"
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        load(path)
    assert message.format(path) in str(error.value)


def test_a_byte_order_mark_is_no_mistake(tmp_path):
    path = tmp_path / "good.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert load(path).run.times[-1] == 5.0


def test_a_missing_case():
    with pytest.raises(
        InputError, match=r"^no file and no case 'endotermic'\. Did you mean 'endothermic'\? `surfacechem cases` lists"
    ):
        load("endotermic")
    with pytest.raises(InputError, match=r"^no file and no case 'x/endotermic.yaml'\. Did you mean 'endothermic'\?"):
        load("x/endotermic.yaml")
    for name in ("a\0b", "a" * 5000):
        with pytest.raises(InputError, match=r"^no file and no case"):
            load(name)


def test_what_is_too_long_is_not_quoted_whole():
    long = "word" * 1250
    for change in (f"run.{long}=1", f"bodies.lower.temperature={long}", f"interface.friction=[{long}]"):
        with pytest.raises(InputError, match=r"ordword.*\[\.\.\.\]") as caught:
            load("exothermic", [change])
        assert len(str(caught.value)) < 400


def test_a_file_beside_is_the_nearest_guess(tmp_path):
    (tmp_path / "pulled.yaml").write_text(GOOD)
    with pytest.raises(InputError, match=r"pull\.yaml'\. Did you mean 'pulled\.yaml'\?"):
        load(tmp_path / "pull.yaml")
    with pytest.raises(InputError, match=r"exotermic\.yaml'\. Did you mean 'exothermic'\?"):
        load(tmp_path / "exotermic.yaml")


def test_suffixes_make_no_names_alike(tmp_path):
    (tmp_path / "ends.yaml").write_text(GOOD)
    with pytest.raises(InputError, match=r"debonding\.yml'\. Did you mean 'debonding'\?"):
        load(tmp_path / "debonding.yml")
    with pytest.raises(InputError, match=r"end\.yml'\. Did you mean 'ends\.yaml'\?"):
        load(tmp_path / "end.yml")
    (tmp_path / "debonding.yaml").write_text(GOOD)
    with pytest.raises(InputError, match=r"debonding\.yml'\. Did you mean 'debonding\.yaml'\?"):
        load(tmp_path / "debonding.yml")


@pytest.mark.parametrize(("part", "whole"), [("lennard", "lennard-jones"), ("cluster", "adhesion-cluster-held")])
def test_a_word_of_a_name_is_near(part, whole):
    known = [whole, "bouncing-plate", "coulomb", "mass-action", "elastic-bonds-at-a-gap"]
    assert nearest(part, known) == f" Did you mean '{whole}'?"


def test_a_folder_or_a_pipe_is_no_case(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, kind in ((tmp_path, "a folder"), (tmp_path / "pipe", "no ordinary file")):
        with pytest.raises(InputError, match=f"this is {kind}; a YAML file is needed"):
            load(path)


def test_an_unreadable_file(tmp_path, monkeypatch):
    path = tmp_path / "locked.yaml"
    path.write_text(GOOD)

    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", refuse)
    with pytest.raises(InputError, match=r"locked\.yaml: cannot be read: Permission denied\."):
        load(path)


def test_a_binary_mechanism(tmp_path):
    (tmp_path / "case.yaml").write_text(GOOD.replace("  sites: 1e18 1/m^2", "  mechanism: m"))
    (tmp_path / "m.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"m\.yaml: no text in UTF-8"):
        load(tmp_path / "case.yaml")
