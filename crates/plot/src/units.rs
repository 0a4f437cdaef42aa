//! Axis titles made from column names.

/// Suffixes of column names and the units they stand for. A suffix comes before every suffix that it ends with.
const UNITS: [(&str, &str); 24] = [
    ("_rad_s2", "rad/s²"),
    ("_m_s2", "m/s²"),
    ("_rad_s", "rad/s"),
    ("_deg_s", "deg/s"),
    ("_km_h", "km/h"),
    ("_kg_m2", "kg m²"),
    ("_m_s", "m/s"),
    ("_n_m", "N m"),
    ("_rad", "rad"),
    ("_deg", "deg"),
    ("_mwh", "mWh"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_mm", "mm"),
    ("_ms", "ms"),
    ("_us", "µs"),
    ("_pa", "Pa"),
    ("_wh", "Wh"),
    ("_m", "m"),
    ("_s", "s"),
    ("_n", "N"),
    ("_v", "V"),
    ("_a", "A"),
    ("_w", "W"),
];

/// Turns a column's name into an axis title with the unit in brackets: `vx_m_s` becomes "vx \[m/s\]".
pub fn axis_title(column: &str) -> String {
    let known = UNITS.iter().find_map(|(end, unit)| Some((column.strip_suffix(end)?, unit)));
    match known.filter(|(name, _)| !name.is_empty()) {
        Some((name, unit)) => format!("{} [{unit}]", name.replace('_', " ")),
        None => column.replace('_', " "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_those_at_the_end_of_names() {
        for (column, title) in [
            ("vx_m_s", "vx [m/s]"),
            ("time_s", "time [s]"),
            ("u4_n", "u4 [N]"),
            ("mean_abs_delta_u4_n", "mean abs delta u4 [N]"),
            ("angular_acceleration_rad_s2", "angular acceleration [rad/s²]"),
            ("thrust_factor_ratio", "thrust factor ratio"),
            ("vehicle_local_position.x", "vehicle local position.x"),
            ("_m", " m"),
        ] {
            assert_eq!(axis_title(column), title);
        }
        // If two suffixes fit, the longer one must come first.
        for (place, (end, _)) in UNITS.iter().enumerate() {
            assert!(UNITS.iter().take(place).all(|(earlier, _)| !end.ends_with(earlier)), "{end}");
        }
    }
}
