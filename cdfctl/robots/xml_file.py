"""Reading the XML of a robot's description: URDF and SRDF."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from xml.etree.ElementTree import Element

from cdfctl.errors import InputError
from cdfctl.reading import read_bytes


def read_robot_xml(path: Path, kind: str, article: str) -> Element:
    """The root element, ``<robot>``, of a file that is to be ``article`` ``kind``: "a" "URDF", "an" "SRDF".

    Raises:
        InputError: it cannot be read, defines XML entities, is not well formed, or has another root, in one line.
    """
    try:
        data = read_bytes(path)
    except FileNotFoundError:
        raise InputError(f"{path}: no such {kind} file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if b"<!ENTITY" in data.replace(b"\0", b""):  # in UTF-16 too
        raise InputError(f"{path}: {article} {kind} with XML entities is not read")
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        line, column = error.position
        raise InputError(f"{path}:{line}:{column + 1}: not well-formed XML: {str(error).split(':')[0]}") from None
    except (ValueError, LookupError) as error:  # an encoding that is not known
        raise InputError(f"{path}: not readable as XML: {error}") from None
    if root.tag != "robot":
        raise InputError(f"{path}: the root element is <{root.tag}>, {article} {kind} has <robot>")
    return root
