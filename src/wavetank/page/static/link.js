// The socket: commands out, pictures and status in. It comes back by itself.

const token = new URLSearchParams(location.search).get("token") ?? sessionStorage.getItem("wavetank token") ?? "";
if (token) sessionStorage.setItem("wavetank token", token);
// The token stays out of the address bar, of screenshots and of the history.
if (location.search) history.replaceState(null, "", location.pathname);

const listeners = {};
let socket = null;
let wait = 250;
let run = ""; // of the server that this page was opened with: another number is another server

/** Call `act` with every message of a type, and with "picture", "open" and "closed". */
export function on(type, act) {
  (listeners[type] ??= []).push(act);
}

/** Let all hear of a message, or of something that happened on the page. */
export function tell(type, value) {
  for (const act of listeners[type] ?? []) act(value);
}

/** Send a command; without a connection it is lost. */
export function send(command) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(command));
}

/** Address of a file of the server that needs the token. */
export function link(path) {
  return `${path}?token=${encodeURIComponent(token)}`;
}

/** Whether there is a connection that should say something. */
export const pending = () => socket?.readyState === WebSocket.OPEN;

export function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}${link("/socket")}`);
  socket.binaryType = "blob";
  socket.onopen = () => { wait = 250; tell("open"); };
  socket.onmessage = ({ data }) => {
    if (data instanceof Blob) tell("picture", data);
    else {
      const message = JSON.parse(data);
      if (message.type === "hello") {
        const anew = run && run !== message.run;
        run = message.run;
        tell("hello", message);
        if (anew) tell("anew");
      } else tell(message.type, message);
    }
  };
  socket.onclose = async () => {
    tell("closed");
    // A server that began anew has another token, and would refuse this page for ever.
    const now = await fetch("/page/run").then((answer) => (answer.ok ? answer.text() : ""), () => "");
    if (now && now !== run && !(await welcome())) { tell("refused", run !== ""); return; }
    setTimeout(connect, wait);
    wait = Math.min(4000, 1.6 * wait);
  };
}

/** Whether the server would let this page in. */
const welcome = () => fetch(link("/"), { method: "HEAD" }).then((answer) => answer.ok, () => true);
