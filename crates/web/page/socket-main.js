import { run } from "./app.js";
import { SocketEngine } from "./socket-engine.js";

run(new SocketEngine());
