//! Domains of plain numbers.

use crate::error::Error;

/// The fault of a value outside of what is allowed.
pub(super) fn fault(name: &str, value: f64, domain: String) -> Error {
    Error::OutOfDomain {
        name: name.to_owned(),
        value: format!("{value:?}"),
        domain,
    }
}

/// Checks that a value lies in an interval; NaN and infinity do not.
pub(super) fn within(
    name: &str,
    value: f64,
    (low, high, unit): (f64, f64, &str),
) -> Result<(), Error> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    let unit = if unit == "1" {
        String::new()
    } else {
        format!(" {unit}")
    };
    Err(fault(name, value, format!("in [{low:?}, {high:?}]{unit}")))
}

/// Checks red, green and blue.
pub(super) fn each_within(
    name: &str,
    values: [f64; 3],
    interval: (f64, f64, &str),
) -> Result<(), Error> {
    for (value, channel) in values.into_iter().zip(["red", "green", "blue"]) {
        within(&format!("{name} ({channel})"), value, interval)?;
    }
    Ok(())
}
