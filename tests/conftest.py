"""What every test shares: benchmarks are not tests, and property tests do not depend on the machine's speed."""

from __future__ import annotations

from hypothesis import settings

collect_ignore = ["benchmarks"]

settings.register_profile("project", deadline=None, print_blob=True)
settings.load_profile("project")
