"""What a search found, in words and as data."""

from __future__ import annotations

from twin.campaign import RunPart
from twin.search.find import Search
from twin.search.goals import Aim
from twin.search.proposal import Proposal


def sentences(search: Search) -> list[str]:
    """Return the search as lines: goal, table, field, proposals with why, what else is to be known."""
    scene, capacity, field = search.scene, search.capacity, search.survey
    goal = search.goal.aim.value
    if search.goal.aim in (Aim.SAFE, Aim.ROCK):
        goal += f", probability of overturning below {100.0 * search.goal.limit:g} %"
    sources = sorted(set(capacity.provenance.values()))
    family = field.family
    size, shape = family.size, family.shape
    looked = f"{field.sizes[0]:.3g} to {field.sizes[-1]:.3g} {size.unit} of {family.size_name}"
    if shape.key:
        low, high = field.shapes[0], field.shapes[-1]
        across = f"{low:.3g} {shape.unit}" if low == high else f"{low:.3g} to {high:.3g} {shape.unit}"
        looked += f", {across} of {family.shape_name}"
    lines = [
        f"scene      {scene.name}: {scene.title}",
        f"goal       {goal}",
        f"table      {capacity.name}: every proposal fits as asked, whole stroke, brake and payload counted"
        + (f" [{'; '.join(sources)}]" if sources else ""),
        f"looked at  {looked}; each proposal judged in {search.futures} futures",
    ]
    lines += [f"{f'run {k + 1}':<10} {line(proposal)}" for k, proposal in enumerate(search.proposals)]
    lines += [f"note       {remark}" for remark in search.remarks]
    count = len(search.proposals)
    lines.append(f"verdict    {count} {'run' if count == 1 else 'runs'} proposed" if count else "verdict    no run")
    return lines


def line(proposal: Proposal) -> str:
    """Return a proposal as one line."""
    return f"{proposal.words}: {proposal.why}"


def as_data(search: Search) -> dict[str, object]:
    """Return the search for `--json`; numbers in the scene file's units, as their keys say."""
    field = search.survey
    shape = field.family.shape.key
    across = {shape: [float(field.shapes[0]), float(field.shapes[-1])]} if shape else {}
    return {
        "scene": search.scene.name,
        "goal": search.goal.aim.value,
        "limit": search.goal.limit,
        "table": search.capacity.model_dump(mode="json"),
        "futures": search.futures,
        "looked_at": {
            field.family.size.key: [float(field.sizes[0]), float(field.sizes[-1])],
            **across,
        },
        "proposals": [proposal_data(proposal) for proposal in search.proposals],
        "notes": list(search.remarks),
    }


def proposal_data(proposal: Proposal) -> dict[str, object]:
    """Return one proposal."""
    clipped = proposal.rehearsal.clipped
    settings = proposal.rehearsal.settings
    return {
        "run": proposal.words,
        "why": proposal.why,
        "score": proposal.score,
        "excitation": proposal.scene.excitation.model_dump(exclude_none=True),
        "overturning": proposal.overturning.data(),
        "usage": {} if clipped is None else dict(clipped.usage),
        "settings": None if settings is None else settings.sentence,
        **proposal.numbers,
    }


def run_parts(search: Search, levels: tuple[float, ...]) -> tuple[list[RunPart], list[str]]:
    """Return the proposals as runs of a campaign, and what is to be said of levels that the machine cannot be set to.

    A run's own levels are those of `levels` that its table makes exactly; a run without any is left out.
    """
    runs: list[RunPart] = []
    notes: list[str] = []
    family = search.survey.family
    for proposal in search.proposals:
        good = tuple(level for level in levels if family.fits_at(proposal.size, proposal.shape, level / 100.0))
        if left := [f"{level:g}" for level in levels if level not in good]:
            notes.append(f"{proposal.words}: {search.capacity.name} cannot make {', '.join(left)} % of it: left out")
        if good:
            runs.append(
                RunPart(
                    name=proposal.words[:60],
                    why=proposal.why[:1000],
                    excitation=proposal.scene.excitation,
                    levels_percent=None if good == levels else good,
                )
            )
    return runs, notes
