"""YAML files that are read, changed in part and written again: the engine's reader has words for switches, and
numbers, that PyYAML has not (`on`, `6e2`)."""

import yaml

from experiment_runs import Refused


class PlainDumper(yaml.emitter.Emitter, yaml.serializer.Serializer, yaml.representer.SafeRepresenter,
                  yaml.resolver.BaseResolver):
    """Writes texts as they are: what `load` reads comes out as it stood."""

    def __init__(self, stream, sort_keys=False, **style):
        layout = {key: style.get(key) for key in ("canonical", "indent", "width", "allow_unicode", "line_break")}
        yaml.emitter.Emitter.__init__(self, stream, **layout)
        yaml.serializer.Serializer.__init__(self)
        yaml.representer.SafeRepresenter.__init__(self, default_flow_style=False, sort_keys=sort_keys)
        yaml.resolver.BaseResolver.__init__(self)


def load(path):
    """A YAML file with every scalar as the text that stands there: `on` stays on, 1.0e7 as it is."""
    try:
        with open(path, encoding="utf-8") as file:
            return yaml.load(file, yaml.BaseLoader)
    except OSError as error:
        raise Refused(f"{path}: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise Refused(f"{path}: no YAML: {' '.join(str(error).split())}") from None


def mapping(path, expected):
    """`load` of a file that has to be a mapping; expected: what it is, in words."""
    read = load(path)
    if not isinstance(read, dict):
        raise Refused(f"{path}: expected {expected}")
    return read


def text_of(document):
    """The reverse."""
    def as_text(node):
        if isinstance(node, dict):
            return {key: as_text(value) for key, value in node.items()}
        if isinstance(node, list):
            return [as_text(one) for one in node]
        return repr(node) if isinstance(node, float) else str(node)
    return yaml.dump(as_text(document), Dumper=PlainDumper, width=1000, sort_keys=False)
