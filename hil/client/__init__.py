"""The client's side of the wire: a link that stays open on TCP, TLS or RTU, whatever the other end does."""
