//! x
use sitl::*; use paper::*; use plant::Model;
fn main(){
 for model in [Model::Simplified, Model::RigidBody] {
 let cases: Vec<(&str, Option<Reading>, Option<Uncertainty>)> = vec![
  ("calm",None,None),("uncertain",None,Some(Uncertainty::DEFAULT)),("gusts",Some(Reading::Persistent),None),("pulses",Some(Reading::Pulses),None),
  ("paper+-",Some(Reading::Persistent),Some(Uncertainty::ALL[0])),("paper++",Some(Reading::Persistent),Some(Uncertainty::ALL[1])),("paper--",Some(Reading::Persistent),Some(Uncertainty::ALL[2])),("paper-+",Some(Reading::Persistent),Some(Uncertainty::ALL[3])),("forces",Some(Reading::Forces),None)];
 for (n,r,u) in cases { let s=scenario(model,r,u).unwrap();
  for k in scenario::ControllerKind::ALL { let t=std::time::Instant::now(); let mut m=metrics::Accumulator::default();
   let lost=flight::fly(&s,k,|x| m.add(x)).unwrap(); let el=t.elapsed().as_secs_f64(); let m=m.finish();
   let f=|v:nalgebra::Vector4<f64>,d:usize| v.iter().map(|x|format!("{x:.d$}")).collect::<Vec<_>>().join(" ");
   println!("{:10} {n:8} {:12} {} | {} | {} | {lost:?} {:.0} ns/step", model.name(), k.name(), f(m.rmse,4), f(m.max_abs,3), f(m.mean_abs_delta_u*1000.,1), el*1e9/60000.); } } }
}
