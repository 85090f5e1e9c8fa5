"""YAML as calibration files have it: also OpenCV's first line and its matrices."""

from typing import Any

from mpcam.errors import InputError


def read_yaml(text: str, name: str) -> Any:
    """The document in a text; an OpenCV matrix is a dictionary with rows, cols and data.

    name: the file's, for messages. Raises InputError, with the line, for a text that is no YAML, has other tags or
    gives a key twice.
    """
    import yaml

    class Loader(yaml.SafeLoader):
        """Knows the tag of matrices, and keys that are there twice."""

    def mapping(loader: yaml.SafeLoader, node: yaml.MappingNode) -> dict[Any, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            if str(key.value) in seen:
                problem = f"the key {key.value} is there twice"
                raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
            seen.add(str(key.value))
        return loader.construct_mapping(node, deep=True)

    for tag in ("map", "opencv-matrix"):
        Loader.add_constructor(f"tag:yaml.org,2002:{tag}", mapping)
    if text.startswith("%YAML:"):  # OpenCV's spelling of the directive
        text = "#" + text
    try:
        return yaml.load(text, Loader)  # a SafeLoader
    except yaml.MarkedYAMLError as error:
        line = f":{error.problem_mark.line + 1}" if error.problem_mark else ""
        raise InputError(f"{name}{line}: not YAML as calibration files use it: {error.problem}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise InputError(f"{name}: not YAML as calibration files use it: {' '.join(str(error).split())}") from None
