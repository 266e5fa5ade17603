"""Prefect plugin: lets `prefect deployment run NAME` mean NAME/NAME, as our deployments are called.

Prefect's client refuses a name without a slash; this hook runs before its commands do.
"""

import sys

from prefect.plugins import register_hook


def with_flow_name(arguments: list[str]) -> list[str]:
    """`… deployment run x …` → `… deployment run x/x …`; anything else unchanged."""
    for i, (command, verb, name) in enumerate(zip(arguments, arguments[1:], arguments[2:], strict=False)):
        if (command, verb) == ("deployment", "run") and not name.startswith("-") and "/" not in name:
            return [*arguments[: i + 2], f"{name}/{name}", *arguments[i + 3 :]]
    return arguments


@register_hook
def setup_environment(*, ctx: object) -> None:
    sys.argv[:] = with_flow_name(sys.argv)
