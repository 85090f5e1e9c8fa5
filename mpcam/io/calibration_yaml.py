"""YAML as calibration files have it: OpenCV's first line and matrices, dotted keys, several documents."""

from dataclasses import dataclass
from typing import Any

from mpcam.errors import InputError


@dataclass(frozen=True)
class Tagged:
    """A value with a tag that is not known: of no harm where nobody asks for it."""

    tag: str

    def __repr__(self) -> str:
        return f"a value tagged {self.tag}, which is no plain YAML: write numbers and lists (array.tolist())"


def read_yaml(text: str, name: str) -> Any:
    """The first document in a text; an OpenCV matrix is a dictionary with rows, cols (or sizes), dt and data.

    name: the file's, for messages. Raises InputError, with the line, for a text that is no YAML or gives a key twice.
    """
    import yaml

    class Loader(yaml.SafeLoader):
        """Knows the tags of matrices and tuples, and keys that are there twice."""

    def mapping(loader: yaml.SafeLoader, node: yaml.Node) -> dict[Any, Any]:
        if not isinstance(node, yaml.MappingNode):
            problem = f"{node.tag} must be a mapping"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
        seen: set[str] = set()
        for key, _ in node.value:
            if str(key.value) in seen:
                problem = f"the key {key.value} is there twice"
                raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
            seen.add(str(key.value))
        return loader.construct_mapping(node, deep=True)

    def sequence(loader: yaml.SafeLoader, node: Any) -> list[Any]:
        return loader.construct_sequence(node, deep=True)

    for tag in ("map", "opencv-matrix", "opencv-nd-matrix"):
        Loader.add_constructor(f"tag:yaml.org,2002:{tag}", mapping)
    Loader.add_constructor("tag:yaml.org,2002:python/tuple", sequence)
    unknown: Any = None  # the tag of all that have no constructor
    Loader.add_constructor(unknown, lambda loader, node: Tagged(node.tag.replace("tag:yaml.org,2002:", "!!")))
    if text.startswith("%YAML:"):  # OpenCV's spelling of the directive
        text = "#" + text
    try:
        documents = [found for found in yaml.load_all(text, Loader) if found is not None]  # a SafeLoader
    except yaml.MarkedYAMLError as error:
        line = f":{error.problem_mark.line + 1}" if error.problem_mark else ""
        raise InputError(f"{name}{line}: not YAML as calibration files use it: {error.problem}") from None
    except (yaml.YAMLError, ValueError, RecursionError, TypeError) as error:
        raise InputError(f"{name}: not YAML as calibration files use it: {' '.join(str(error).split())}") from None
    return documents[0] if documents else None
