//! Shortens the SVG pictures of a page.

use core::fmt::Write;

/// Returns `svg` with polylines as paths of relative steps, which take half the space.
pub(crate) fn with_short_paths(svg: &str) -> String {
    let lines = svg.split_inclusive('\n').map(|line| short(line).unwrap_or_else(|| line.to_owned()));
    lines.collect()
}

/// Converts one line of a picture; returns `None` unless it is a polyline of integers.
fn short(line: &str) -> Option<String> {
    let attributes = line.strip_prefix("<polyline ")?;
    let (before, rest) = attributes.split_once("points=\"")?;
    let (points, after) = rest.split_once('"')?;
    let mut path = format!("<path {before}d=\"");
    let mut last: Option<[i32; 2]> = None;
    for point in points.split_ascii_whitespace() {
        let (x, y) = point.split_once(',')?;
        let point @ [x, y]: [i32; 2] = [x.parse().ok()?, y.parse().ok()?];
        // Writing to a String cannot fail. A minus sign also separates numbers.
        let _ = match last {
            None => write!(path, "M{x} {y}l"),
            Some([from_x, from_y]) => {
                let (dx, dy) = (x.wrapping_sub(from_x), y.wrapping_sub(from_y));
                let [before_x, before_y] = [dx, dy].map(|d| if d < 0 { "" } else { " " });
                write!(path, "{before_x}{dx}{before_y}{dy}")
            }
        };
        last = Some(point);
    }
    Some(path + "\"" + after)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::indexing_slicing, reason = "a test that panics has failed")]
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn only_polylines_of_whole_numbers_change() {
        let svg = "<svg>\n<polyline fill=\"none\" points=\"5,7 9,3 2,3 \"/>\n<text>points=\"1,2\"</text>\n</svg>\n";
        let short = "<svg>\n<path fill=\"none\" d=\"M5 7l 4-4-7 0\"/>\n<text>points=\"1,2\"</text>\n</svg>\n";
        assert_eq!(with_short_paths(svg), short);
        let odd = "<polyline points=\"5,7 x\"/>\n<polyline points=\"1.5,2 \"/>";
        assert_eq!(with_short_paths(odd), odd);
    }

    proptest! {
        #[test]
        fn a_path_goes_through_the_same_points(points in prop::collection::vec((-9999..9999, -9999..9999), 1..30)) {
            let text: String = points.iter().map(|(x, y)| format!("{x},{y} ")).collect();
            let path = with_short_paths(&format!("<polyline points=\"{text}\"/>"));
            let numbers = path.replace('-', " -").replace(['M', 'l', '"'], " ");
            let numbers: Vec<i32> = numbers.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            let mut at = (0, 0);
            let walked = numbers.chunks_exact(2).map(|step| {
                at = (at.0 + step[0], at.1 + step[1]);
                at
            });
            prop_assert_eq!(walked.collect::<Vec<_>>(), points);
        }
    }
}
