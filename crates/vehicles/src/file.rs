//! Reading of vehicle files.

use crate::data_sheet;
use crate::parts::{self, DragConditions, FORCE_MAX};
use crate::vehicle::{CASCADE, SAMPLE, Vehicle};
use afbc::adaptive::Gains;
use afbc::{Profile, Settings};
use afbc_control::drag::KnownDrag;
use afbc_estimator::Settings as Estimation;
use afbc_files::read::words::out_of_range;
use afbc_files::read::{FileError, Table};
use afbc_flight_core::ArmingLimits;
use afbc_flight_core::motor::Curve;
use afbc_plant::instruments::ImuModel;
use afbc_plant::{BatteryModel, Contact, Drag, GroundEffect, InstrumentSuite, Realism, RotorLayout, Rotors};
use afbc_types::{Axis, Declared, Mounting, PLUS, Parameters, PerAxis, ROTOR_POSITION, ROTORS, Range, Rotor};
use core::convert::Infallible;
use nalgebra::Vector3;
use std::path::Path;

/// Accepted position of a rotor \[m\]. In arm lengths, it must also lie within [`ROTOR_POSITION`].
const POSITION: Range = Range::new("position_m", -100.0, 100.0);
/// Largest relative difference between `arm_m` and the mean distance of the rotors.
const ARM_TOLERANCE: f64 = 0.01;
/// Time step for checking drag and ground \[s\]; a scenario checks them again with its own step.
const STEP_S: f64 = 0.001;
/// Remedy for drag that is out of range for the laws' feed-forward.
const CHECK: &str = "check mass_kg, thrust_factor_n_s2 and the values in [drag]";
/// Remedy for a vehicle that cannot hover with a margin.
const UNFIT: &str =
    "AFBC would fly this vehicle without a margin; choose stronger or quicker rotors, less mass, or [gains]";

/// Reads and checks the vehicle file at `path`.
///
/// # Errors
/// Every mistake, each as one line.
pub fn load(path: &Path) -> Result<Vehicle, FileError> {
    let text = afbc_files::read::text(path, "vehicle")?;
    let stem = path.file_stem().map_or("".into(), |stem| stem.to_string_lossy());
    parse(&path.display().to_string(), &text, &stem)
}

/// Reads and checks a vehicle from its `text`. Error messages call the file `file`. The vehicle is called `name` if the
/// text gives no name.
///
/// # Errors
/// Every mistake, each as one line.
pub fn parse(file: &str, text: &str, name: &str) -> Result<Vehicle, FileError> {
    afbc_files::read::document(file, text, SAMPLE, |root| read(root, file, text, name))
}

/// Direction of rotation of a rotor, seen from above.
#[derive(Clone, Copy)]
enum SpinDirection {
    Ccw,
    Cw,
}

impl SpinDirection {
    const fn name(self) -> &'static str {
        match self {
            SpinDirection::Ccw => "ccw",
            SpinDirection::Cw => "cw",
        }
    }
}

fn read(mut root: Table<'_>, file: &str, text: &str, name: &str) -> Result<Vehicle, FileError> {
    let [name, description] = afbc_files::read::title(&mut root, name)?;
    let parameters = masses(need(&mut root, "vehicle")?)?;
    let (rotors, rotor_height_m) = frame(&mut root, parameters.arm_m)?;
    let (actuators, force_max_n) = actuators(&mut root, &parameters)?;
    let curve = motor(need(&mut root, "motor")?)?;
    let lag_s = actuators.time_constant_s as f32;
    let mut flight_gains = Profile::Flight.gains_for(&parameters.to_f32(), lag_s);
    let mut flight_settings = Profile::Flight.settings_for(force_max_n as f32, lag_s);
    gains(&mut root, &mut flight_gains, &mut flight_settings)?;
    let (imu, part) = imu(&mut root)?;
    let (estimation, estimation_stated) = estimation(&mut root, &parameters, rotors.len(), part.as_ref())?;
    let (mut arming, mut guidance) = (ArmingLimits::DEFAULT, afbc_guidance::Settings::DEFAULT);
    parts::declared(root.table("arming")?, &mut arming)?;
    parts::declared(root.table("guidance")?, &mut guidance)?;
    let mut vehicle = Vehicle {
        name,
        description,
        parameters,
        rotors,
        force_max_n,
        realism: Realism { rotors: actuators, ..Realism::default() },
        curve,
        imu,
        imu_part: part,
        estimation,
        estimation_stated,
        arming,
        guidance,
        flight_gains,
        flight_settings,
        text: text.into(),
        file: file.into(),
    };
    // Comes before drag and ground: their checks would refuse the same vehicle with a less useful message.
    if let Err(error) = vehicle.check() {
        let with = &["vehicle", "rotors", "rotor", "gains"];
        root.clash("vehicle", with, format!("{}; {UNFIT}", out_of_range(&error)))?;
    }
    surroundings(&mut root, &mut vehicle, rotor_height_m)?;
    let known = &mut vehicle.flight_settings.common.drag;
    if let (Some(drag), &KnownDrag::NONE) = (vehicle.realism.drag, &*known) {
        *known = known_drag(&drag, &vehicle.parameters, vehicle.rotors.len());
        if let Err(error) = known.validate() {
            let with = &["vehicle", "rotors", "rotor", "drag"];
            root.clash("drag", with, format!("per mass, {}; {CHECK}", out_of_range(&error)))?;
        }
    }
    root.finish()?;
    Ok(vehicle)
}

/// Returns the drag that laws compensate, for a vehicle with `count` rotors.
fn known_drag(drag: &Drag, vehicle: &Parameters<f64>, count: usize) -> KnownDrag {
    let Parameters { mass_kg, gravity_m_s2, thrust_factor_n_s2, .. } = *vehicle;
    // Sum of all rotor speeds in hover, n sqrt(m g/(n b)). Body drag: half the density times the mean of both areas.
    let all_rad_s = libm::sqrt(count as f64 * mass_kg * gravity_m_s2 / thrust_factor_n_s2);
    KnownDrag {
        rotor_drag_1_s: (drag.blade_n_s2_m * all_rad_s / mass_kg) as f32,
        rotor_height_m: drag.rotor_height_m as f32,
        body_drag_1_m: (0.25 * drag.air_density_kg_m3 * (drag.area_m2.x + drag.area_m2.y) / mass_kg) as f32,
    }
}

/// Reads `[drag]` and `[ground]`.
fn surroundings(root: &mut Table<'_>, vehicle: &mut Vehicle, rotor_height_m: f64) -> Result<(), FileError> {
    let Vehicle { parameters, rotors, realism, .. } = vehicle;
    let frame = RotorLayout::new(rotors).map_err(|error| root.fault_at("rotor", out_of_range(&error)))?;
    if let Some(table) = root.table("drag")? {
        let default = Drag { rotor_height_m, ..Drag::DEFAULT };
        let rotor_max_rad_s = realism.rotors.max_rad_s;
        let conditions = DragConditions { parameters, frame: &frame, rotor_max_rad_s, step_s: STEP_S };
        realism.drag = Some(parts::drag(table, default, Drag::ROT_HEIGHT.range.name, &conditions)?);
    }
    if let Some(table) = root.table("ground")? {
        let default = (Contact { rotor_height_m, ..Contact::DEFAULT }, GroundEffect::DEFAULT);
        let (contact, effect) = parts::ground(table, default, Contact::ROT_HEIGHT.range.name, parameters, STEP_S)?;
        (realism.contact, realism.ground_effect) = (Some(contact), effect);
    }
    Ok(())
}

/// Returns the table under `key`, which is required.
fn need<'a>(root: &mut Table<'a>, key: &'static str) -> Result<Table<'a>, FileError> {
    root.table(key)?.ok_or_else(|| root.missing(key, &format!("add [{key}], as in vehicles/paper.toml")))
}

/// Reads `[vehicle]`. Every key but gravity is required.
fn masses(mut table: Table<'_>) -> Result<Parameters<f64>, FileError> {
    let mut parameters = Parameters::PAPER;
    table.declared(&mut parameters)?;
    parameters.visit(&mut |declaration, _| {
        let is_known = declaration.range.name == Parameters::<f64>::GRAVITY.range.name;
        if is_known { Ok(()) } else { table.require(&declaration.range) }
    })?;
    table.finish()?;
    Ok(parameters)
}

/// Reads `[[rotor]]`; returns the rotors in arm lengths and their mean height \[m\].
fn frame(root: &mut Table<'_>, arm_m: f64) -> Result<(Vec<Rotor<f64>>, f64), FileError> {
    let (mut rotors, mut places_m, tables) = (Vec::new(), Vec::new(), root.few_tables("rotor")?);
    ROTORS.check(tables.len() as f64).or_else(|_| {
        let cure = "add one [[rotor]] with position_m and spin for each of four to eight rotors";
        root.clash("rotor", &[], format!("{} rotors; {cure}", tables.len()))
    })?;
    let mut are_known = ROTORS.check(tables.len() as f64).is_ok();
    for mut table in tables {
        let at_m = table.need_vector(POSITION.name, &POSITION)?;
        let spin = table.need_choice("spin", &[SpinDirection::Ccw, SpinDirection::Cw], SpinDirection::name)?;
        let rotor = Rotor { x: at_m.x / arm_m, y: at_m.y / arm_m, pushes_left: matches!(spin, SpinDirection::Cw) };
        table.finish()?;
        if !table.knows(POSITION.name) {
            are_known = false;
            continue;
        }
        for along in [rotor.x, rotor.y] {
            if let Err(error) = ROTOR_POSITION.check(along) {
                let problem =
                    format!("{}, in multiples of arm_m; move the rotor, or change arm_m", out_of_range(&error));
                table.clash(POSITION.name, &["vehicle.arm_m"], problem)?;
                are_known = false;
            }
        }
        rotors.push(rotor);
        places_m.push(at_m);
    }
    if !are_known {
        return Ok((PLUS.map(|rotor| rotor.to_f64()).to_vec(), 0.0));
    }
    let mean = |of: fn(&Vector3<f64>) -> f64| places_m.iter().map(of).sum::<f64>() / places_m.len() as f64;
    let distance_m = mean(|at_m| libm::hypot(at_m.x, at_m.y));
    if (distance_m - arm_m).abs() > ARM_TOLERANCE * distance_m {
        let problem =
            format!("arm_m is {arm_m}, but the rotors are {distance_m:.4} m from the z axis; change one of them");
        root.clash("rotor", &["vehicle.arm_m", "rotor"], problem)?;
    }
    Ok((rotors, mean(|at_m| at_m.z)))
}

/// Reads `[rotors]` and `[battery]`; returns the rotors and the largest force of one rotor \[N\].
fn actuators(root: &mut Table<'_>, parameters: &Parameters<f64>) -> Result<(Rotors, f64), FileError> {
    let table = need(root, "rotors")?;
    table.require(&Rotors::LAG.range)?;
    table.require(&FORCE_MAX)?;
    let mut rotors = parts::rotors(Some(table), Rotors::DEFAULT, parameters)?;
    rotors.battery =
        root.table("battery")?.map(|table| parts::battery(table, BatteryModel::THREE_CELLS)).transpose()?;
    let force_max_n = parameters.thrust_factor_n_s2 * rotors.max_rad_s * rotors.max_rad_s;
    Ok((rotors, force_max_n))
}

/// Reads `[motor]`. Every key is required.
fn motor(mut table: Table<'_>) -> Result<Curve, FileError> {
    let mut curve = Curve::DEFAULT;
    table.declared(&mut curve)?;
    curve.visit(&mut |declaration, _| table.require(&declaration.range))?;
    table.finish()?;
    Ok(curve)
}

/// Reads `[imu]`. Returns the mounting, and the sensor if the table names a part or states its noise figures.
fn imu(root: &mut Table<'_>) -> Result<(Mounting<f64>, Option<ImuModel>), FileError> {
    let mut mounting = Mounting::DEFAULT;
    let Some(mut table) = root.table("imu")? else { return Ok((mounting, None)) };
    table.declared(&mut mounting)?;
    let named = parts::preset(&mut table, &ImuModel::PRESETS)?;
    let is_known = named.is_some() || parts::TRIADS.iter().any(|triad| table.holds_table(triad));
    let mut part = named.unwrap_or_default();
    if is_known {
        // The lever arm is refused here; only a scenario may set it.
        table.declared_but(ImuModel::LEVER.range.name, &mut part)?;
        parts::groups(&mut table, &mut part, &parts::TRIADS)?;
    }
    table.finish()?;
    Ok((mounting, is_known.then_some(part)))
}

/// Reads `[estimator]`. Missing keys get values from the data sheet of the inertial sensor, if the vehicle's file has
/// one, or else the defaults. Gravity is the vehicle's, clamped to the estimator's range. Also returns the names of the
/// keys that the table states.
fn estimation(
    root: &mut Table<'_>,
    parameters: &Parameters<f64>,
    rotors: usize,
    imu: Option<&ImuModel>,
) -> Result<(Estimation, Vec<&'static str>), FileError> {
    let gravity = Estimation::GRAVITY.range;
    let gravity_m_s2 = parameters.gravity_m_s2.clamp(gravity.min, gravity.max);
    let default = Estimation { gravity_m_s2: gravity_m_s2 as f32, ..Estimation::DEFAULT };
    let for_part = |imu| data_sheet::settings(&InstrumentSuite::default(), imu, rotors, gravity_m_s2, STEP_S);
    let mut estimation = imu.map_or(default, for_part);
    let mut stated = Vec::new();
    if let Some(mut table) = root.table("estimator")? {
        table.forbid(gravity.name, "the gravity comes from [vehicle]; remove this key")?;
        table.declared(&mut estimation)?;
        let Ok(()) = estimation.visit(&mut |declaration, _| {
            stated.extend(Some(declaration.range.name).filter(|name| table.has(name)));
            Ok::<(), Infallible>(())
        });
        table.finish()?;
    }
    Ok((estimation, stated))
}

/// Reads `[gains.flight.afbc.AXIS]` and `[gains.flight.cascade]`. The gains of other laws are read elsewhere, since
/// this crate does not know the laws.
fn gains(root: &mut Table<'_>, gains: &mut PerAxis<Gains>, settings: &mut Settings) -> Result<(), FileError> {
    let Some(mut all) = root.table("gains")? else { return Ok(()) };
    let Some(mut flight) = all.table(Profile::Flight.name())? else { return all.finish() };
    if let Some(mut axes) = flight.table("afbc")? {
        for axis in Axis::ALL {
            if let Some(mut table) = axes.table(axis.name())? {
                table.declared(&mut gains[axis])?;
                table.finish()?;
            }
        }
        axes.finish()?;
    }
    if let Some(mut cascade) = flight.table(CASCADE)? {
        cascade
            .forbid(afbc_control::Settings::DT.range.name, "the time step comes from the scenario; remove this key")?;
        cascade.forbid(
            afbc_control::Settings::FORCE_MAX.range.name,
            "the rotors' largest force follows from [rotors]; remove this key",
        )?;
        cascade.declared(settings)?;
        cascade.declared_in("limits", settings)?;
        cascade.finish()?;
    }
    all.finish()
}
