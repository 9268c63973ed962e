"""The hostile corpus: every case, by subject."""

from . import arguments, drawings, farm, meshes, outputs, plate_formats, plates, scene_files, scene_text, schema_limits, states, work
from .case import Case


def cases(schema: dict) -> list[Case]:
    """All cases. `schema` is what `bansho schema` prints."""
    subjects = (scene_text, scene_files, plates, plate_formats, meshes, drawings, outputs, arguments, states, work, farm)
    found = [case for subject in subjects for case in subject.cases()] + schema_limits.cases(schema)
    names = [(case.kind, case.name) for case in found]
    twice = {name for name in names if names.count(name) > 1}
    assert not twice, f"two cases of one name: {twice}"
    return found
