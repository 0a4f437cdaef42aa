//! The tables of docs/results.md and docs/reference/results.md agree with the code.

use afbc_campaign::compare;
use afbc_report::results;
use afbc_scenario::built_in;
use afbc_sim::run::FlightResult;

const PAGE: &str = include_str!("../../docs/results.md");
const REFERENCE: &str = include_str!("../../docs/reference/results.md");

/// True if the figures differ by at most the last digit, or by 2 %, by which another host's rounding may change
/// chatter.
fn agree(page: &str, code: &str) -> bool {
    match (page.parse::<f64>(), code.parse::<f64>()) {
        (Ok(page), Ok(code)) => (page - code).abs() <= 1.5e-4 + 0.02 * code.abs(),
        _ => page == code,
    }
}

#[test]
fn the_results_page_is_what_the_code_does() {
    let (_, page, _) = results::parts(REFERENCE).expect("both markers");
    let scenarios = results::scenarios().expect("the paper's parameters are in range");
    let code = results::markdown(&results::fly(scenarios, &|| ()).expect("parameters in range"));
    assert_eq!(page.lines().count(), 2 + 9 * 2 * 2, "nine scenarios, two models, two laws");
    assert_eq!(page.lines().count(), code.lines().count());
    for (page, code) in page.lines().zip(code.lines()) {
        let cells = |line: &str| line.split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
        let (page, code) = (cells(page), cells(code));
        let same = page.len() == code.len() && page.iter().zip(&code).all(|(page, code)| agree(page, code));
        let cure = "run `cargo run --release -- results --write docs/reference/results.md`";
        assert!(same, "{cure}\npage {page:?}\ncode {code:?}");
    }
}

/// Compares the printed table of `sitl compare` with new flights. It has the standard contenders in `hardware`, and an
/// asterisk at the best printed value of each column.
#[test]
fn the_table_on_real_rotors_is_what_flies() {
    let scenario = built_in("hardware").unwrap().read().unwrap();
    let figures = |contender| {
        let metrics = FlightResult::fly(&scenario, contender, u64::MAX).unwrap().metrics;
        let largest = metrics.max_abs.xyz().max();
        let [x, y, z, psi] = metrics.rmse.into();
        [x, y, z, psi, largest]
            .map(|error| format!("{error:.4}"))
            .into_iter()
            .chain([format!("{:.1}", metrics.mean_abs_delta_u.w * 1e3)])
    };
    let rows: Vec<Vec<String>> = compare::standard().iter().map(|contender| figures(contender).collect()).collect();
    let number = |text: &str| text.trim_end_matches('*').parse::<f64>().unwrap();
    let code: Vec<String> = rows
        .iter()
        .map(|row| {
            let star = |(column, cell): (usize, &String)| {
                let best = rows.iter().all(|other| number(&other[column]) >= number(cell));
                format!("{cell}{}", if best { "*" } else { "" })
            };
            row.iter().enumerate().map(star).collect::<Vec<_>>().join(" | ")
        })
        .collect();

    let section = PAGE.split("## On real rotors").nth(1).unwrap();
    let page = section.lines().filter(|line| line.starts_with("| ")).skip(1);
    let page: Vec<_> =
        page.map(|line| line.trim_matches('|').split_once('|').unwrap().1.trim()).take(rows.len()).collect();
    assert_eq!(page.len(), rows.len(), "a row for each: {page:?}");
    for (page, code_row) in page.iter().zip(&code) {
        let same = page.split(" | ").zip(code_row.split(" | ")).all(|(page, code)| {
            agree(page.trim_end_matches('*'), code.trim_end_matches('*')) && page.ends_with('*') == code.ends_with('*')
        });
        assert!(same && page.matches('|').count() == code_row.matches('|').count(), "{page}\n{code:#?}");
    }
}
