"""Numbers as people read them, three digits and no needless zeros, and as JSON can hold them."""

import math


def format_number(value: float, digits: int = 3) -> str:
    """`value` to so many significant digits: "-" for NaN, "inf", thousands separated, powers of ten where shorter."""
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    if value == 0:
        return "0"
    if float(value).is_integer() and 1000 <= abs(value) < 1e15:
        return f"{int(value):,}"
    exponent = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if exponent < -3 or exponent >= 6:
        mantissa = f"{value / 10.0**exponent:.{digits - 1}f}"
        return f"{_strip(mantissa)}e{exponent}"
    return _strip(f"{value:,.{max(digits - 1 - exponent, 0)}f}")


def format_percent(share: float, digits: int = 3) -> str:
    """A share of 1 in percent, without the sign."""
    return format_number(share * 100, digits)


def format_column(name: str, value: float, digits: int = 3) -> str:
    """A number of `Row` as it is shown: shares in percent, everything else as `format_number`."""
    return format_percent(value, digits) if name.endswith("_mismatch") else format_number(value, digits)


def format_spread(value: float, spread: float) -> str:
    """A measured value and half its interquartile range, both with the value's decimals: "1.65 ±0.08"."""
    text = format_number(value)
    if math.isnan(spread) or not math.isfinite(value) or "e" in text:
        return text
    decimals = max(2 - math.floor(math.log10(value)), 0) if value > 0 else 2
    return f"{value:,.{decimals}f} ±{spread / 2:,.{decimals}f}"


def json_number(value: float | None) -> float | int | str | None:
    """A number as JSON can hold it: None for NaN, "inf" for infinity, an integer where it is one."""
    if value is None or math.isnan(value):
        return None
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return int(value) if float(value).is_integer() and abs(value) < 2**53 else float(value)


def _strip(text: str) -> str:
    return text.rstrip("0").rstrip(".") if "." in text else text
