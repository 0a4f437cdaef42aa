//! Tests of a page at a vehicle: the state it gets, its commands, and refusals.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_scenario::built_in;
use afbc_serve::page::{PageBackend, PageReply};
use afbc_serve::{Server, ServerAction, TimeFlow, TimeRate, fleet};
use proptest::prelude::*;
use serde_json::{Value, json};

const FLOW: TimeFlow = TimeFlow { rate: TimeRate::Times(1.0), paused: false };

struct Page {
    server: Server,
    backend: PageBackend,
}

impl Page {
    fn of(scenario: &str) -> Self {
        let scenario = built_in(scenario).unwrap().read().unwrap();
        let server = Server::new(&fleet(&scenario, 1).unwrap(), 1).unwrap();
        Page { server, backend: PageBackend::new() }
    }

    fn fly(&mut self, seconds: f64) {
        let end_s = self.server.now_s() + seconds;
        while self.server.now_s() < end_s {
            let Page { server, backend } = self;
            server.step(|vehicle, bytes| backend.sent(vehicle, bytes), |_| ());
            backend.update(server);
        }
    }

    /// Flies until `done` is true for the frame, at most `most_s`.
    fn fly_until(&mut self, most_s: f64, what: &str, done: impl Fn(&Value) -> bool) {
        let end_s = self.server.now_s() + most_s;
        while !done(&self.frame()) {
            assert!(self.server.now_s() < end_s, "not {what} after {most_s} s: {}", self.frame());
            self.fly(0.1);
        }
    }

    fn frame(&mut self) -> Value {
        serde_json::from_str(&self.backend.frame(&self.server, FLOW).unwrap()).unwrap()
    }

    fn command(&mut self, command: &Value) -> PageReply {
        self.backend.command(&mut self.server, &command.to_string())
    }

    /// Sends a command that must have no answer.
    fn order(&mut self, command: &Value) {
        assert_eq!(self.command(command), PageReply::default(), "{command}");
    }

    /// Returns the distance between two places \[m\].
    fn off_m(place: &Value, place_m: [f64; 3]) -> f64 {
        let off_m = (0..3).map(|axis| (place[axis].as_f64().unwrap() - place_m[axis]).powi(2));
        off_m.sum::<f64>().sqrt()
    }
}

#[test]
fn a_page_flies_a_vehicle() {
    for scenario in ["mocap", "outdoor"] {
        let mut page = Page::of(scenario);
        let description: Value = serde_json::from_str(&page.backend.description(&page.server).unwrap()).unwrap();
        assert_eq!((&description["kind"], &description["scenario"]), (&json!("hello"), &json!(scenario)));
        assert_eq!(description["rotors"].as_array().unwrap().len(), 4);
        page.fly_until(20.0, "ready", |frame| !frame["estimate"].is_null());
        page.fly(8.0);
        page.order(&json!({ "do": "take_off", "height_m": 3.0 }));
        page.fly_until(20.0, "in the air", |frame| frame["airborne"] == true);
        page.fly(6.0);
        let frame = page.frame();
        let height_m = frame["truth"]["position_m"][2].as_f64().unwrap();
        assert!((height_m - 3.0).abs() < 1.0, "{scenario}: {height_m} m");
        page.order(&json!({ "do": "go_to", "position_m": [4.0, 2.0, 4.0] }));
        page.fly(12.0);
        let place = page.frame()["truth"]["position_m"].clone();
        let off_m = Page::off_m(&place, [4.0, 2.0, 4.0]);
        assert!(off_m < if scenario == "mocap" { 0.2 } else { 3.0 }, "{scenario}: {off_m} m off");
        page.order(&json!({ "do": "land" }));
        page.fly_until(30.0, "disarmed", |frame| frame["armed"] == false);
    }
}

/// A plan is uploaded, drawn within 0.1 m of where it was clicked, and flown. The estimate may move a little in
/// between.
#[test]
fn a_plan_is_drawn_where_it_was_clicked() {
    let mut page = Page::of("outdoor");
    page.fly_until(20.0, "ready", |frame| !frame["estimate"].is_null());
    page.fly(8.0);
    let places_m = [[6.0, 3.0, 4.0], [6.0, -3.0, 5.0]];
    let corners_m = [[-20.0, -20.0], [20.0, -20.0], [20.0, 20.0], [-20.0, 20.0]];
    page.order(&json!({ "do": "plan", "waypoints_m": places_m, "fence_m": corners_m }));
    page.fly(3.0);
    let frame = page.frame();
    let mission = frame["mission"].as_array().unwrap();
    for place_m in places_m {
        let nearest_m = mission.iter().map(|point| Page::off_m(&point["position_m"], place_m));
        assert!(nearest_m.fold(f64::MAX, f64::min) < 0.1, "{place_m:?} of {mission:?}");
    }
    let fence = frame["fence"].as_array().unwrap();
    assert_eq!((fence.len(), &fence[0]["inside"]), (1, &json!(true)));
    for (drawn, corner_m) in fence[0]["corners_m"].as_array().unwrap().iter().zip(corners_m) {
        let [x_m, y_m] = [0, 1].map(|axis: usize| drawn[axis].as_f64().unwrap() - corner_m[axis]);
        assert!(x_m.hypot(y_m) < 0.1, "{drawn} instead of {corner_m:?}");
    }
    page.order(&json!({ "do": "start_mission" }));
    page.fly_until(60.0, "at the second place", |frame| Page::off_m(&frame["truth"]["position_m"], places_m[1]) < 3.0);
}

#[test]
fn parameters_are_set_by_name() {
    let mut page = Page::of("mocap");
    page.fly(3.0);
    let before = page.frame()["parameter_changes"].as_u64().unwrap();
    page.order(&json!({ "do": "parameter", "name": "MIS_TAKEOFF_ALT", "value": 4.5 }));
    page.fly(1.0);
    assert!(page.frame()["parameter_changes"].as_u64().unwrap() > before);
    let values: Value = serde_json::from_str(&page.command(&json!({ "do": "values" })).messages[0]).unwrap();
    assert_eq!(values["values"]["MIS_TAKEOFF_ALT"], 4.5);
}

/// Bad commands get one line with the cause, and change nothing.
#[test]
fn nonsense_is_refused() {
    let mut page = Page::of("mocap");
    page.fly(3.0);
    let many = vec![[0.0; 3]; 51];
    for command in [
        json!({ "do": "fly_away" }),
        json!({ "do": "take_off" }),
        json!({ "do": "take_off", "height_m": 0.0 }),
        json!({ "do": "take_off", "height_m": 1e9 }),
        json!({ "do": "take_off", "height_m": "3" }),
        json!({ "do": "go_to", "position_m": [0.0, 0.0] }),
        json!({ "do": "go_to", "position_m": [1e30, 0.0, 0.0] }),
        json!({ "do": "plan", "waypoints_m": many }),
        json!({ "do": "plan", "waypoints_m": [[0.0, 0.0, 1e6]] }),
        json!({ "do": "plan", "fence_m": [[0.0, 0.0], [5.0, 0.0], [0.0, 5.0]] }),
        json!({ "do": "parameter", "name": "A_NAME_THAT_IS_TOO_LONG", "value": 1.0 }),
        json!({ "do": "parameter", "name": "MIS_TAKEOFF_ALT", "value": null }),
        json!({ "do": "line", "text": "quit" }),
        json!({ "do": "line", "text": "step 1000" }),
        json!({ "do": "line", "text": "wind a gale" }),
        json!({ "do": "arm", "now": true }),
        json!([]),
    ] {
        let PageReply { messages, action } = page.command(&command);
        assert_eq!((messages.len(), action), (1, ServerAction::Nothing), "{command}");
        let reply: Value = serde_json::from_str(&messages[0]).unwrap();
        assert!(reply["text"].as_str().unwrap().starts_with("error "), "{command}: {reply}");
    }
    page.fly(1.0);
    assert_eq!(page.frame()["armed"], false);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The vehicle flies on for any text that a page sends, and its frames are valid JSON.
    #[test]
    fn no_input_stops_it(text in ".{0,60}", lines in prop::collection::vec("[a-z]{1,9} [0-9a-z. -]{0,12}", 3)) {
        let mut page = Page::of("mocap");
        page.backend.command(&mut page.server, &text);
        page.backend.command(&mut page.server, &format!("{{\"do\":{text:?}}}"));
        for line in lines {
            page.command(&json!({ "do": "line", "text": line }));
        }
        page.fly(0.05);
        prop_assert_eq!(&page.frame()["kind"], "frame");
    }
}

/// The severity of a text comes from the vehicle, or from its refusal; the page does not guess it from words.
#[test]
fn texts_say_how_grave_they_are() {
    let mut page = Page::of("mocap");
    page.fly_until(20.0, "ready", |frame| !frame["estimate"].is_null());
    page.fly(8.0);
    // A vehicle on the ground refuses to return.
    page.order(&json!({ "do": "return" }));
    page.fly(0.5);
    let refused = page.frame()["texts"].clone();
    let gravest = |texts: &Value| texts.as_array().unwrap().iter().filter_map(|it| it["severity"].as_u64()).min();
    assert!(gravest(&refused).unwrap() <= 4, "{refused}");
}
