"""Does a certificate prove what it says, and of this model? `verify` for what is in memory, `verify_file` for files."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from cyclopean.api.inputs import Model, Path, Reading, assembly_of

if TYPE_CHECKING:
    from cyclopean.proof import Report


def verify(
    certificate: Mapping[str, object],
    *,
    model: "Model | None" = None,
    units: str | None = None,
    tolerance: float | tuple[float, float] | str | None = None,
) -> "Report":
    """Check one certificate in exact arithmetic, and whether it is about a model.

    Parameters
    ----------
    certificate : mapping
        As `Result.certificate` holds it; whatever is malformed is answered with `proved=False`.
    model : path, Assembly, anything with an `assembly`, or a list or table of bodies, optional
        What it has to be about. Where it is about another one, `proved` is false and `reason` says what differs. What
        the model leaves open, such as gravity, is no difference; `Report.assumed` says all that the proof assumes.
    units : str, optional
        Unit of length of a model file that does not say it.
    tolerance : float, (float, float) or "auto", optional
        With which the model was checked: gap (m) within which faces touch, and how far they may lean (degrees).

    Raises
    ------
    InputError
        The model cannot be read, or is none that could be checked.

    Examples
    --------
    >>> import cyclopean
    >>> arch = cyclopean.arch(8, span=2.0, thickness=0.3)
    >>> proof = cyclopean.check(arch, mu=0.7).certificate
    >>> verify(proof, model=arch).proved, verify(proof, model=cyclopean.arch(8, span=2.1, thickness=0.3)).proved
    (True, False)
    """
    from cyclopean import proof

    report = proof.verify(certificate)
    if model is None or not report.proved:
        return report
    from cyclopean.analysis import Settings, compare

    found = compare(certificate, assembly_of(model, Reading(units))[0], Settings(tolerance=tolerance))
    if not found.differences:
        return report
    return replace(report, proved=False, reason=f"proved, but not of this model: {'; '.join(found.differences)}")


def verify_file(
    path: Path,
    *,
    model: "Model | None" = None,
    units: str | None = None,
    tolerance: float | tuple[float, float] | str | None = None,
) -> "Report":
    """Check the certificate in a file; the rest as `verify`.

    Raises
    ------
    OSError
        The file cannot be read.
    NotACertificateError
        It holds no certificate.
    InputError
        As `verify`.
    """
    from cyclopean import proof

    if model is None:
        return proof.verify_file(path)
    return verify(proof.read_file(path), model=model, units=units, tolerance=tolerance)
