"""The end of a generated module: the motion along a mode, by numerical integration."""

MOTION = '''
from contfric.flow.integrated import advance, first_hit, stationary


@helper
def never(mode, c):
    return @NEVER@


@kernel(flow_signature)
def flow(mode, t0, y0, dt, p, which, y1, jac):
    advance(field, mode, t0, y0, dt, p, which, y1, jac)


@kernel(hit_signature)
def hit(mode, c, target, on, t0, y0, dt_max, p, y1):
    if never(mode, c):
        return -1.0
    return first_hit(field, observe_at, rate_at, mode, c, target, on, t0, y0, dt_max, p, y1)


@kernel(turning_signature)
def turning(mode, c, t0, y0, dt, p, times, values):
    if dt <= 0.0 or never(mode, c):
        return 0
    return stationary(field, observe_at, rate_at, mode, c, t0, y0, dt, p, times, values)


def compiled_flow():
    """Return the compiled functions of this model."""
    return CompiledFlow(flow, observe, level, turning, hit, period, rate, reset)
'''
