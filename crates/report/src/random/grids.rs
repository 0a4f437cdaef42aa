//! Tables of the contenders' ranking, for a paper.

use super::RandomResults;
use super::cells::{cells, heads, legend};
use crate::differences::{TEST, TEST_LEGEND, test};
use crate::grid::{Grid, GridCell};

/// Returns one table per vehicle, and one for all vehicles together.
pub(super) fn grids(judged: &RandomResults<'_>) -> Vec<Grid> {
    let heads: Vec<String> = ["law".into()].into_iter().chain(heads(judged)).chain(TEST.map(String::from)).collect();
    let grid = |group: &super::results::VehicleGroup<'_>| {
        let rows = judged.contenders().iter().zip(&group.rankings).map(|(contender, ranking)| {
            let tested = ranking.difference.filter(|_| contender.title() != judged.baseline());
            let tested = tested.map(|difference| test(&difference.test, difference.p_holm)).unwrap_or_default();
            let cells = cells(group, ranking).into_iter().chain(tested).map(GridCell::from);
            (contender.title().to_owned(), cells.collect())
        });
        Grid {
            caption: format!("{}, {} flights, {}", group.name(), group.flights, judged.words()),
            heads: heads.clone(),
            rows: rows.collect(),
            note: format!(
                "{} {TEST_LEGEND} A pair compares both laws in one seed or, if only one seed was flown, \
                 in one of its flights.",
                legend(judged)
            ),
        }
    };
    judged.groups.iter().map(grid).collect()
}
