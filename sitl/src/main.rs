//! x
use paper::*;
use plant::Model;
use sitl::*;
fn main() {
    for model in [Model::Simplified, Model::RigidBody] {
        for uncertainty in Uncertainty::ALL {
            let s = scenario(model, Case { uncertainty: Some(uncertainty), ..Case::DEFAULT }).unwrap();
            for k in scenario::ControllerKind::ALL {
                let r = run::Run::fly(&s, k, 10).unwrap();
                let mut tail = nalgebra::Vector4::<f64>::zeros();
                let mut n = 0.;
                for x in &r.log {
                    if x.time_s >= 55. {
                        tail += metrics::tracking_error(x).abs();
                        n += 1.;
                    }
                }
                println!("{k:?} {:?} {:?} tail {:?}", r.metrics.rmse, r.metrics.final_error, tail / n);
            }
        }
    }
}
