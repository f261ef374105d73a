"""Machine code of the kernels: loops over springs use the widest vectors of the processor."""

import re
from collections import Counter

import llvmlite.binding as llvm
import numba
import pytest
from builders import small_cloth

from cloth_ros.model.integrators import kick_drift_kernel
from cloth_ros.model.integrators.integrator import Step

# Three loops over the springs, each with a reciprocal root for each of twelve springs.
ROOTS = 3 * 12


def features() -> str:
    """Return the features of the processor for which Numba compiles."""
    config = numba.config
    if config.CPU_NAME is None and config.CPU_FEATURES is None:
        return llvm.get_host_cpu_features().flatten()
    return config.CPU_FEATURES or ''


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_every_loop_over_springs_is_vectorised(precision, monkeypatch, tmp_path):
    if '+sse4.1' not in features():
        pytest.skip('no processor for which loops with square roots are vectorised')
    monkeypatch.setattr(numba.config, 'CACHE_DIR', str(tmp_path))  # only new code can be inspected
    monkeypatch.setattr(
        'cloth_ros.model.integrators.kick_drift.kernel.compose',
        kick_drift_kernel.compose.__wrapped__,
    )
    simulation = small_cloth(springs__damping=1e-3, solver__precision=precision)._simulation
    simulation._kick_drift.apply(simulation.state, (Step(1e-4, 1e-4),), (0.0, 0.0, 0.0))
    (assembly,) = simulation._kick_drift._kernel.inspect_asm().values()
    packed = Counter(re.findall(r'\bv?rsqrt(?:14)?ps\b.*?([xyz]mm)\d+\n', assembly))
    # Scalar code remains at the ends of the loops.
    assert packed.total() >= ROOTS
    single = precision == 'single'  # the roots of double precision begin in single precision
    if ',-prefer-256-bit' in features():  # as `jit` chooses for a processor with AVX-512
        assert packed['zmm' if single else 'ymm'] >= ROOTS
    elif single and '+avx' in features():
        assert packed['ymm'] + packed['zmm'] >= ROOTS
