"""Changes of documents for tests of what is read from outside."""

from hypothesis import strategies as st

from surfacechem.errors import InputError
from surfacechem.format import load_text


def places_of(value, path=()):
    """The path of every value of a document."""
    yield path
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in entries:
        yield from places_of(child, (*path, key))


def changed(value, path, change):
    """The document with the value at a path replaced; None removes it."""
    if not path:
        return change(value)
    if isinstance(value, dict):
        return {**value, path[0]: changed(value[path[0]], path[1:], change)}
    return [changed(child, path[1:], change) if i == path[0] else child for i, child in enumerate(value)]


def without(value, data):
    """A mapping or list without one of its entries."""
    if isinstance(value, dict) and value:
        gone = data.draw(st.sampled_from(sorted(value)))
        return {key: child for key, child in value.items() if key != gone}
    return value[:-1] if isinstance(value, list) else value


def renamed(value, keys, data):
    """A mapping with an entry under another key."""
    if not isinstance(value, dict) or not value:
        return value
    old, new = data.draw(st.sampled_from(sorted(value))), data.draw(st.sampled_from(keys))
    return {new if key == old else key: child for key, child in value.items()}


def mutated(plain, keys, values, data):
    """Plain data with a value replaced, removed, renamed, added or repeated."""
    path = data.draw(st.sampled_from(list(places_of(plain))))
    kind = data.draw(st.sampled_from(["replace", "remove", "rename", "add", "repeat"]))
    if kind == "replace":
        new = data.draw(values)
        return changed(plain, path, lambda _: new)
    if kind == "remove":
        return changed(plain, path, lambda value: without(value, data))
    if kind == "rename":
        return changed(plain, path, lambda value: renamed(value, keys, data))
    if kind == "add":
        key, new = data.draw(st.sampled_from(keys)), data.draw(values)
        return changed(plain, path, lambda value: {**value, key: new} if isinstance(value, dict) else value)
    return changed(plain, path, lambda value: value * 2 if isinstance(value, list) else value)


def garbled(text, data):
    """A text with some of its characters replaced."""
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(text)))
        end = min(len(text), start + data.draw(st.integers(0, 12)))
        text = text[:start] + data.draw(st.text("aT0 .:-[]{}#&*!|>'\"%@\n\t\0e", max_size=6)) + text[end:]
    return text


def refusal(text, folder="."):
    """The error of a text that is no case, beside files in a folder, else None."""
    try:
        load_text(text, "fuzz", folder).system()
    except InputError as error:
        return error
    return None
