//! Colours of the figures, each in a light and a dark variant. A contender has the same colour in every report.

use afbc_drawing::{PAPER, Rgb, hex};
use core::hash::Hasher;
use twox_hash::XxHash64;

/// A colour on white, and its variant in dark mode.
pub(super) type Shades = [Rgb; 2];

const fn shades(light: u32, dark: u32) -> Shades {
    [rgb(light), rgb(dark)]
}

const fn rgb(hex: u32) -> Rgb {
    let [_, r, g, b] = hex.to_be_bytes();
    [r, g, b]
}

pub(super) const BLACK: Rgb = rgb(0x1A1A1A);
pub(super) const GREY: Rgb = rgb(0x646464);
pub(super) const GRID: Rgb = rgb(0xE2E2E2);
pub(super) const FRAME: Rgb = rgb(0x969696);
/// Colour of the reference.
pub(super) const WANTED: Rgb = rgb(0xB0B0B0);
/// Colour of the lines at onsets and at ends of bands.
pub(super) const EDGE: Rgb = rgb(0x828282);
/// Tints of events; overlapping events have different tints.
pub(super) const TINTS: [Rgb; 5] = [rgb(0xF7EED4), rgb(0xD5E5F2), rgb(0xF6DCDC), rgb(0xDAEFD8), rgb(0xE6DDF4)];

/// All colours that belong to no contender.
const ROLES: [Shades; 12] = [
    [PAPER, rgb(0x16181D)],
    [BLACK, rgb(0xE8E8E8)],
    [GREY, rgb(0xA8ACB3)],
    [GRID, rgb(0x2C3038)],
    [FRAME, rgb(0x737983)],
    [WANTED, rgb(0x6A707A)],
    [EDGE, rgb(0x9A9FA8)],
    [TINTS[0], rgb(0x4A3F1C)],
    [TINTS[1], rgb(0x1E3A54)],
    [TINTS[2], rgb(0x54282C)],
    [TINTS[3], rgb(0x24452A)],
    [TINTS[4], rgb(0x3D2E5A)],
];

/// Colours of the built-in contenders. Everyone can tell any two of them apart, including colour-blind people. The
/// contrast is at least 3 : 1 on white and 4 : 1 in dark mode. No colour is so dark or pale that a thin line looks
/// black or white.
const KNOWN: [(&str, Shades); 10] = [
    ("afbc", shades(0x0072B2, 0x4DA6FF)),
    ("backstepping", shades(0xA90045, 0xFF0700)),
    ("pid", shades(0x319EA6, 0x2B8C94)),
    ("geometric", shades(0xFF407C, 0xE09FA7)),
    ("indi", shades(0x7A0078, 0xFF34BB)),
    ("l1", shades(0x9076FF, 0xD9C2FF)),
    ("dfbc", shades(0x7F702B, 0x77814D)),
    ("mpc", shades(0x005800, 0x86DD35)),
    ("afbc-as-printed", shades(0xDB7D1B, 0xFFED9C)),
    ("afbc-monitored", shades(0x001DEE, 0xAEFFE1)),
];

/// Colours of all other contenders, chosen by a hash of the name.
const OTHERS: [Shades; 10] = [
    shades(0x696C8C, 0xA1A5C7),
    shades(0x885B34, 0xDCB282),
    shades(0x5A406E, 0xDAB0FA),
    shades(0x4A1A33, 0xFFD4E0),
    shades(0x9D9459, 0xCCE576),
    shades(0x162072, 0x6690BB),
    shades(0xDE6CBC, 0xAB6F81),
    shades(0x364ACC, 0x6C6ECB),
    shades(0x6E69F3, 0x5392FC),
    shades(0x760A03, 0xCA8E79),
];

/// Seed of the hash. With this seed, no two contenders of a built-in campaign share a colour.
const SEED: u64 = 203;

/// Returns the colour of contender `name`; it does not depend on other contenders.
pub(super) fn color(name: &str) -> Rgb {
    if let Some((_, [light, _])) = KNOWN.iter().find(|(known, _)| *known == name) {
        return *light;
    }
    let mut hasher = XxHash64::with_seed(SEED);
    hasher.write(name.as_bytes());
    let choice = hasher.finish() % OTHERS.len() as u64;
    OTHERS.get(choice as usize).map_or(BLACK, |[light, _]| *light)
}

/// Returns for each name how many names before it have the same colour; this number chooses the dash pattern.
pub(super) fn repeats(names: &[&str]) -> Vec<usize> {
    let before = |(index, name): (usize, &&str)| names.iter().take(index).filter(|n| color(n) == color(name)).count();
    names.iter().enumerate().map(before).collect()
}

/// Returns every colour with its variant in dark mode.
pub(super) fn all() -> Vec<Shades> {
    ROLES.iter().chain(KNOWN.iter().map(|(_, shades)| shades)).chain(&OTHERS).copied().collect()
}

/// Returns a colour on white and its variant in dark mode, as SVG attributes.
pub(super) fn both(color: Rgb) -> [String; 2] {
    let known = all().into_iter().find(|[light, _]| *light == color);
    known.unwrap_or([color; 2]).map(hex)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::indexing_slicing, clippy::unwrap_used, reason = "tests")]
    use super::*;
    use afbc_campaign::{BUILT_IN, Campaign};
    use std::collections::HashSet;

    fn linear([r, g, b]: Rgb) -> [f64; 3] {
        [r, g, b].map(|part| {
            let part = f64::from(part) / 255.0;
            if part <= 0.04045 { part / 12.92 } else { libm::pow((part + 0.055) / 1.055, 2.4) }
        })
    }

    fn times(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
        m.map(|row| row.iter().zip(v).map(|(a, b)| a * b).sum())
    }

    /// Returns the contrast ratio of WCAG 2.
    fn contrast(a: Rgb, b: Rgb) -> f64 {
        let luminance = |color| times(&[[0.2126, 0.7152, 0.0722], [0.0; 3], [0.0; 3]], linear(color))[0] + 0.05;
        let (a, b) = (luminance(a), luminance(b));
        a.max(b) / a.min(b)
    }

    /// Colour vision matrices: normal, protanopia, deuteranopia, tritanopia (Machado, Oliveira and Fernandes 2009).
    const SIGHTS: [[[f64; 3]; 3]; 4] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    ];

    /// Returns the smallest distance over all types of colour vision, in hundredths of Oklab.
    fn distance(a: Rgb, b: Rgb) -> f64 {
        let lab = |color, sight| {
            let seen = times(sight, linear(color)).map(|part| part.clamp(0.0, 1.0));
            let cones = times(
                &[
                    [0.4122214708, 0.5363325363, 0.0514459929],
                    [0.2119034982, 0.6806995451, 0.1073969566],
                    [0.0883024619, 0.2817188376, 0.6299787005],
                ],
                seen,
            );
            times(
                &[
                    [0.2104542553, 0.7936177850, -0.0040720468],
                    [1.9779984951, -2.4285922050, 0.4505937099],
                    [0.0259040371, 0.7827717662, -0.8086757660],
                ],
                cones.map(libm::cbrt),
            )
        };
        let apart = |sight| {
            let (a, b) = (lab(a, sight), lab(b, sight));
            100.0 * libm::sqrt(a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum())
        };
        SIGHTS.iter().map(apart).fold(f64::INFINITY, f64::min)
    }

    /// Returns L*, a*, b* of a colour as seen with this colour vision, under daylight (D65).
    fn lab(color: Rgb, sight: &[[f64; 3]; 3]) -> [f64; 3] {
        let seen = times(sight, linear(color)).map(|part| part.clamp(0.0, 1.0));
        let xyz = times(
            &[
                [0.4124564 / 0.95047, 0.3575761 / 0.95047, 0.1804375 / 0.95047],
                [0.2126729, 0.7151522, 0.0721750],
                [0.0193339 / 1.08883, 0.1191920 / 1.08883, 0.9503041 / 1.08883],
            ],
            seen,
        );
        let [x, y, z] = xyz
            .map(|part| if part > 216.0 / 24389.0 { libm::cbrt(part) } else { (24389.0 / 27.0 * part + 16.0) / 116.0 });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// Returns the colour difference CIEDE2000 (Sharma, Wu and Dalal 2005).
    fn ciede2000([l1, a1, b1]: [f64; 3], [l2, a2, b2]: [f64; 3]) -> f64 {
        let seventh = |chroma: f64| {
            let power = libm::pow(chroma, 7.0);
            libm::sqrt(power / (power + libm::pow(25.0, 7.0)))
        };
        let grown = 1.0 + 0.5 * (1.0 - seventh(0.5 * (libm::hypot(a1, b1) + libm::hypot(a2, b2))));
        let polar =
            |a: f64, b: f64| (libm::hypot(grown * a, b), libm::atan2(b, grown * a).to_degrees().rem_euclid(360.0));
        let ((c1, h1), (c2, h2)) = (polar(a1, b1), polar(a2, b2));
        let is_grey = c1 * c2 == 0.0;
        let turn = if is_grey { 0.0 } else { (h2 - h1 + 540.0).rem_euclid(360.0) - 180.0 };
        let hue = if is_grey { h1 + h2 } else { (h1 + 0.5 * turn).rem_euclid(360.0) };
        let (lightness, chroma) = (0.5 * (l1 + l2), 0.5 * (c1 + c2));
        let cos = |degrees: f64| libm::cos(degrees.to_radians());
        let weight = 1.0 - 0.17 * cos(hue - 30.0) + 0.24 * cos(2.0 * hue) + 0.32 * cos(3.0 * hue + 6.0)
            - 0.2 * cos(4.0 * hue - 63.0);
        let off = (lightness - 50.0) * (lightness - 50.0);
        let dl = (l2 - l1) / (1.0 + 0.015 * off / libm::sqrt(20.0 + off));
        let dc = (c2 - c1) / (1.0 + 0.045 * chroma);
        let dh = 2.0 * libm::sqrt(c1 * c2) * libm::sin((0.5 * turn).to_radians()) / (1.0 + 0.015 * chroma * weight);
        let bend = (hue - 275.0) / 25.0;
        let rotation = -2.0 * seventh(chroma) * libm::sin((60.0 * libm::exp(-bend * bend)).to_radians());
        libm::sqrt(dl * dl + dc * dc + dh * dh + rotation * dc * dh)
    }

    /// The pairs are from the table in Sharma, Wu and Dalal 2005.
    #[test]
    fn differences_of_colors_are_the_published_ones() {
        for (a, b, published) in [
            ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
            ([50.0, -1.0, 2.0], [50.0, 0.0, 0.0], 2.3669),
            ([50.0, 2.49, -0.001], [50.0, -2.49, 0.0011], 7.2195),
            ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
            ([22.7233, 20.0904, -46.6940], [23.0331, 14.9730, -42.5619], 2.0373),
            ([90.8027, -2.0831, 1.4410], [91.1528, -1.6435, 0.0447], 1.4441),
        ] {
            assert!((ciede2000(a, b) - published).abs() < 1e-4, "{a:?} {b:?}: {}", ciede2000(a, b));
        }
    }

    /// With normal vision, neighbours in Okabe and Ito's palette are 20 apart. From 10 on nobody confuses two lines.
    #[test]
    fn no_two_laws_have_colors_that_look_alike() {
        for shade in [0, 1] {
            for (i, (name, a)) in KNOWN.iter().enumerate() {
                for (sight, least) in SIGHTS.iter().zip([20.0, 10.0, 10.0, 10.0]) {
                    let seen = |color| lab(color, sight);
                    for (other, b) in &KNOWN[..i] {
                        let apart = ciede2000(seen(a[shade]), seen(b[shade]));
                        assert!(apart >= least, "{name}, {other}, shade {shade}: {apart}");
                    }
                }
                let [lightness, red, blue] = lab(a[shade], &SIGHTS[0]);
                let (dark, pale) = [(25.0, 65.0), (50.0, 95.0)][shade];
                assert!((dark..=pale).contains(&lightness), "{name}, shade {shade}: lightness {lightness}");
                assert!(libm::hypot(red, blue) >= 24.0, "{name}, shade {shade}: a grey");
            }
        }
    }

    #[test]
    fn known_contenders_are_distinguished_by_everyone_on_white_and_in_the_dark() {
        for shade in [0, 1] {
            let paper = ROLES[0][shade];
            for (i, (name, a)) in KNOWN.iter().enumerate() {
                let least = [3.0, 4.0][shade];
                assert!(contrast(a[shade], paper) >= least, "{name}: {}", contrast(a[shade], paper));
                for (other, b) in &KNOWN[..i] {
                    // Okabe and Ito's palette of six colours reaches 6.
                    assert!(distance(a[shade], b[shade]) >= 8.0, "{name}, {other}: {}", distance(a[shade], b[shade]));
                }
            }
            for (i, a) in OTHERS.iter().enumerate() {
                assert!(contrast(a[shade], paper) >= 3.0, "{i}");
                let others = OTHERS[..i].iter().chain(KNOWN.iter().map(|(_, shades)| shades));
                assert!(others.map(|b| distance(a[shade], b[shade])).all(|apart| apart >= 2.0), "{i}");
            }
            assert!(contrast(ROLES[1][shade], paper) >= 7.0 && contrast(ROLES[2][shade], paper) >= 4.5);
            for tint in &ROLES[7..] {
                assert!(contrast(ROLES[2][shade], tint[shade]) >= 3.0, "labels on {tint:?}");
            }
        }
    }

    #[test]
    fn contenders_of_one_built_in_campaign_differ_while_there_are_colors() {
        for built_in in &BUILT_IN {
            let campaign: Campaign = built_in.read().unwrap();
            let names: Vec<_> = campaign.scenario.contenders.iter().map(|contender| contender.name.as_str()).collect();
            let colors: HashSet<_> = names.iter().map(|name| hex(color(name))).collect();
            let all = if names.len() <= OTHERS.len() { names.len() } else { OTHERS.len() / 2 };
            assert!(colors.len() >= all, "{}: {names:?}", built_in.name);
        }
    }

    #[test]
    fn a_color_depends_on_the_name_alone_and_shared_ones_are_numbered() {
        let names: Vec<String> = (0..40).map(|i| format!("contender {i}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let numbered: HashSet<_> = names.iter().zip(repeats(&names)).map(|(name, n)| (hex(color(name)), n)).collect();
        assert_eq!(numbered.len(), names.len());
        assert_eq!(repeats(&["afbc", "pid", "afbc"]), [0, 0, 1]);
    }
}
