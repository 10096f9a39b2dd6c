/* SPDX-License-Identifier: MIT */
/*
 * The mailbox: many small requests in flight to one PoKeys device at once,
 * none of them ever waiting.
 *
 * This is the engine of the daemon itself, offered to programs without a
 * daemon as well. It allocates nothing and knows no socket: bytes leave and
 * arrive through two function pointers (struct pokeys_io).
 *
 *	pokeys_device_init(&dev, &io, NULL);
 *	id = CreateRequestAsync(&dev, op, NULL, 0, target, sizeof target);
 *	SendRequestAsync(&dev, id);
 *	...
 *	PK_ReceiveAndDispatch(&dev);
 *	PK_TimeoutAndRetryCheck(&dev, 5000);
 *	if (pokeys_request_state(&dev, id) == POKEYS_REQUEST_DONE) ...
 *
 * Most programs need only these four. They use the current time of
 * CLOCK_MONOTONIC. The functions below them read no clock and take the time as
 * now_ns. Use those if your cycle already has a time stamp, or for tests in
 * virtual time:
 *
 *	SendRequestAsync()		pokeys_request_send()
 *	PK_ReceiveAndDispatch()		pokeys_device_receive()
 *	PK_TimeoutAndRetryCheck()	pokeys_device_set_timeout(), pokeys_device_check()
 *
 * now_ns is in ns of any monotonic clock, the same one in every call for a
 * device. A time before the latest one counts as the latest. If a program uses
 * both forms for one device, or the four together with another function that
 * takes now_ns (such as pokeys_request_cancel()), now_ns must be the time of
 * CLOCK_MONOTONIC.
 *
 * Each cycle receive first and check afterwards, so that an answer which is
 * already here is not taken for lost. Check in each cycle, also with nothing in
 * flight: creating has no time of its own, so ids rest until a call tells it.
 *
 * Which answer belongs to which request: a reply carries eight bits of request
 * id and its operation, nothing else (protocol section 1.4). So an id rests
 * after use. If an answer may still be under way (a try of it was never
 * answered) the id rests for reply_lifetime_ns, and is then passed over for
 * 512 more requests as long as another is free. After a request that was sent
 * once and answered, only a copy made by the network could still come: the id
 * rests for id_rest_ns after the answer and after each copy seen, and ids go
 * round in order, so that it comes again after some 256 requests (85 ms at
 * 3000 requests/s) - after some 512 for the same operation where several
 * operations take turns, sooner while losses keep many ids blocked, but never
 * before id_rest_ns. A copy that is later than that, and hits the moments in
 * which the same id of the same operation is in flight, cannot be told from the
 * answer by anything in the packet. The pulse engine status is the exception:
 * it echoes a check byte, which differs for 255 turns.
 *
 * Threads: one pokeys_device_t belongs to one thread. Realtime: every
 * function here is bounded in time, allocates nothing and makes no system
 * call of its own (send and receive may, that is theirs; and the three that
 * read the clock do where the kernel has no vDSO clock).
 */
#ifndef POKEYS_ASYNC_H
#define POKEYS_ASYNC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
	POKEYS_PACKET_SIZE = 64,   /* every request and every reply, protocol section 1.1 */
	POKEYS_PAYLOAD_OFFSET = 8, /* first payload byte, protocol section 1.2 */
	POKEYS_PAYLOAD_SIZE = 56,
	POKEYS_MAILBOX_SIZE = 256,  /* one entry for each request id */
	POKEYS_WINDOW_MAX = 64,     /* most requests in flight at once */
	POKEYS_KEPT_REQUESTS = 128, /* an ended one stays readable for so many more */
};

/* For options.retries: none at all (0 is the default number). */
#define POKEYS_NO_RETRIES UINT32_MAX

/*
 * An operation as it stands on the wire: byte 1 of the packet (protocol
 * section 4). A sub-operation, where there is one, is params[0].
 */
typedef uint8_t pokeys_command_t;

/* What may happen to a request whose answer did not come. */
enum pokeys_class {
	POKEYS_CLASS_READ,    /* resend freely */
	POKEYS_CLASS_WRITE,   /* idempotent: resend the newest value, not the old one */
	POKEYS_CLASS_ONESHOT, /* never sent twice; the end is POKEYS_REQUEST_UNKNOWN */
};

enum pokeys_request_state {
	POKEYS_REQUEST_FREE = 0,  /* no such request */
	POKEYS_REQUEST_CREATED,   /* packet built, not sent */
	POKEYS_REQUEST_IN_FLIGHT, /* sent at least once, no answer yet */
	POKEYS_REQUEST_DONE,      /* answered; the target is filled */
	POKEYS_REQUEST_TIMED_OUT, /* read or write: retries exhausted */
	POKEYS_REQUEST_UNKNOWN,   /* one-shot without answer: executed or not, read back */
	POKEYS_REQUEST_CANCELLED,
};

/* What became of a datagram that was delivered. */
enum pokeys_verdict {
	POKEYS_VERDICT_NONE = 0, /* none was delivered yet */
	POKEYS_VERDICT_ACCEPTED, /* completed a request */
	POKEYS_VERDICT_BAD_SOURCE,
	POKEYS_VERDICT_BAD_LENGTH,
	POKEYS_VERDICT_BAD_MAGIC,
	POKEYS_VERDICT_BAD_CHECKSUM,
	POKEYS_VERDICT_NOT_IN_FLIGHT,
	POKEYS_VERDICT_DUPLICATE,
	POKEYS_VERDICT_BAD_OPERATION,
	POKEYS_VERDICT_BAD_CHECK,
	POKEYS_VERDICT_STALE,
	POKEYS_VERDICTS
};

/* Where a received packet came from, as far as the transport knows. */
struct pokeys_rx {
	uint64_t t_ns;    /* when the kernel took it in, by now_ns' clock, 0 = unknown */
	uint32_t address; /* IPv4 source, host byte order, 0 = unknown (not checked) */
	uint16_t port;    /* source port, host byte order */
	uint16_t reserved;
};

/*
 * How bytes leave and arrive.
 * send: 0, or -errno. -EAGAIN and -ENOBUFS mean "not now": the request counts
 *       as lost and is retried at its deadline.
 * receive: length of the next datagram (0 for an empty one), or -EAGAIN when
 *       there is none. At most `size` bytes are stored; a longer datagram
 *       reports its true length so that it is counted as oversize.
 * Neither may block.
 */
struct pokeys_io {
	int (*send)(void *context, const uint8_t *packet, size_t length);
	int (*receive)(void *context, uint8_t *packet, size_t size, struct pokeys_rx *rx);
	void *context;
};

typedef struct pokeys_device pokeys_device_t;
typedef struct mailbox_entry mailbox_entry_t;

/*
 * Called once when a request ends, from inside pokeys_device_receive,
 * pokeys_device_deliver, pokeys_device_check (or the forms without now_ns),
 * pokeys_request_cancel or pokeys_device_reset.
 * entry->state says how, entry->response_buffer holds the reply if it is
 * POKEYS_REQUEST_DONE. The entry is valid during the call. The callback may
 * create, send and cancel requests; it must not receive, check or reset.
 */
typedef void (*pokeys_parser_t)(pokeys_device_t *dev, const mailbox_entry_t *entry, void *context,
				uint64_t now_ns);

/*
 * Called just before an idempotent write is sent again: refill
 * entry->request_buffer[8..63] (and params) with the newest value. The header
 * is completed afterwards. Cancelling the request here means it is not sent.
 */
typedef void (*pokeys_refresh_t)(pokeys_device_t *dev, mailbox_entry_t *entry, void *context);

struct mailbox_entry {
	uint8_t request_id;
	pokeys_command_t command_sent;
	uint8_t request_class; /* enum pokeys_class */
	uint8_t state;         /* enum pokeys_request_state */
	uint8_t tries;         /* transmissions so far that the transport took */
	uint8_t missed;        /* of them past their deadline and not answered yet */
	bool response_ready;
	bool auto_free; /* freed by itself after the parser ran */
	int retries_left;
	uint64_t timestamp_created;    /* ns */
	uint64_t timestamp_sent;       /* ns, last transmission */
	uint64_t timestamp_first_sent; /* ns */
	uint64_t timestamp_received;   /* ns, from the transport where it knows */
	uint64_t waiting_since;        /* ns, the last attempt to transmit, refused or not */
	uint64_t deadline;             /* ns, of the current try */
	void *target_ptr;              /* payload from byte 8 is copied here */
	size_t target_size;            /* never more than this is copied; at most 56 */
	pokeys_parser_t parser;
	pokeys_refresh_t refresh;
	void *context;
	uint8_t request_buffer[POKEYS_PACKET_SIZE];
	uint8_t response_buffer[POKEYS_PACKET_SIZE];
	uint64_t serial;            /* counts the requests of this mailbox, from 1 */
	uint64_t fixed_deadline_ns; /* pokeys_request_set_deadline(), 0 = adaptive */
	bool once;                  /* pokeys_request_set_once() */
	const void *operation;      /* the engine's: row of the operation table */
};

/* Each outcome of a received packet and of a request has a counter of its own. */
struct pokeys_statistics {
	uint64_t created;
	uint64_t sent;                 /* transmissions that the transport took ... */
	uint64_t resent;               /* ... of them, repetitions */
	uint64_t send_failed;          /* transmissions that the transport refused */
	uint64_t received;             /* datagrams taken from the transport */
	uint64_t accepted;             /* replies that completed a request */
	uint64_t accepted_earlier_try; /* ... of them, perhaps answers to an earlier try */
	uint64_t bad_length, bad_magic, bad_checksum, bad_source;
	uint64_t bad_operation; /* id in flight, operation or sub-operation differs */
	uint64_t bad_check;     /* operation's own check (echo, status check byte) */
	uint64_t not_in_flight; /* stray: no request of that id is open */
	uint64_t duplicate;     /* a request that was just answered, again */
	uint64_t stale;         /* older than any answer can be */
	uint64_t missed;        /* tries without a reply by their deadline */
	uint64_t late;          /* ... of them, answered afterwards */
	uint64_t lost;          /* ... never answered, known when the id is used again */
	uint64_t done, timed_out, unknown, cancelled;
	uint64_t refused_window; /* create: window full */
	uint64_t refused_budget; /* send, or a resend that was due: budget used up */
	uint64_t refused_id;     /* create: no id is free */
	uint32_t in_flight, in_flight_high;
	uint64_t rtt_last_ns, rtt_smoothed_ns, rtt_variation_ns, rtt_min_ns, rtt_max_ns;
	uint64_t deadline_ns; /* what a request sent now would get */
};

/* All in ns unless said otherwise; 0 in a field means its default. */
struct pokeys_options {
	uint64_t deadline_floor_ns;   /* default 300 us; range 50 us .. 1 s */
	uint64_t deadline_ceiling_ns; /* default 50 ms; range floor .. 5 s */
	uint64_t deadline_initial_ns; /* before a sample; default 10 ms; floor..ceiling */
	uint64_t reply_lifetime_ns;   /* how late an answer may be; default 500 ms, 1 ms..60 s */
	uint32_t retries;             /* of a read or write; default 3, range 1..20, or none */
	uint32_t window;              /* in flight at most; default 8, range 1..64 */
	uint32_t retry_budget;        /* resends a second; default 200, range 1..100000 */
	uint32_t send_budget;         /* transmissions a second; default 8000, 1..1000000 */
	uint32_t peer_address;        /* IPv4 host byte order; 0 = do not check */
	uint16_t peer_port;           /* 0 = do not check */
	uint8_t first_id;
	uint8_t reserved;
	uint64_t id_rest_ns; /* after a clean answer; default 20 ms, at most lifetime */
};

/*
 * One device's mailbox. The fields are public so that it can be embedded and
 * read (statistics); write to none of them.
 */
struct pokeys_device {
	struct pokeys_io io;
	struct pokeys_options options;
	struct pokeys_statistics statistics;
	mailbox_entry_t mailbox[POKEYS_MAILBOX_SIZE]; /* index = request id */
	uint64_t id_free_after[POKEYS_MAILBOX_SIZE];  /* ns; an id is not reused before */
	uint8_t in_flight[POKEYS_WINDOW_MAX];         /* ids, oldest first */
	uint32_t in_flight_count;
	uint8_t next_id;
	uint8_t backoff;       /* doublings of the deadline */
	uint8_t missed_in_row; /* tries, up to 24 */
	uint64_t now;          /* latest time seen */
	uint64_t retry_tokens, send_tokens, tokens_time;
	uint64_t serial;                             /* of the newest request */
	uint64_t backoff_time;                       /* of the last doubling */
	uint32_t open_count;                         /* created or in flight */
	uint64_t id_shun_until[POKEYS_MAILBOX_SIZE]; /* serial; passed over until then */
	uint16_t id_key[POKEYS_MAILBOX_SIZE];        /* what the last reply looked like */
	uint8_t id_turn;                             /* of the ids; varies the check byte */
	uint8_t verdict;                             /* enum pokeys_verdict, last datagram's */
	uint64_t timeout_ns;                         /* of a try, 0 = adaptive */
};

/*
 * Prepare a mailbox. `options` may be NULL (defaults). io->receive may be NULL
 * if packets are delivered with pokeys_device_deliver(). 0, or -EINVAL for an
 * option out of its range or a missing send.
 */
int pokeys_device_init(pokeys_device_t *dev, const struct pokeys_io *io,
		       const struct pokeys_options *options);

/*
 * Forget everything in flight (each request ends POKEYS_REQUEST_CANCELLED,
 * its id stays blocked for as long as it could still be answered) and the
 * measured round trip. For a device found again. Counters and the timeout are
 * kept.
 */
void pokeys_device_reset(pokeys_device_t *dev, uint64_t now_ns);

/* From now on accept only packets from here (host byte order; 0 = any). */
void pokeys_device_set_peer(pokeys_device_t *dev, uint32_t address, uint16_t port);

/*
 * How long each try of a read or write waits for its answer, counted from its
 * transmission, before pokeys_device_check() sends it again or ends it. It is
 * exact (it neither adapts nor doubles), and it holds for requests in flight
 * as well. 0 = the adaptive deadline, as after pokeys_device_init(); there is
 * no upper limit, UINT64_MAX = wait for ever. A one-shot, which is never sent
 * again, waits for this time or for deadline_ceiling_ns, whichever is
 * longer. A request with pokeys_request_set_deadline() keeps its own.
 */
void pokeys_device_set_timeout(pokeys_device_t *dev, uint64_t timeout_ns);

/*
 * Build a request, take a mailbox entry, touch no network. `params` are the
 * header bytes 2..5 (at most 4, missing ones are 0). The reply's payload,
 * from byte 8, will be copied to `target` (may be NULL), never more than
 * `target_size` bytes. The class is the operation table's (protocol section
 * 4); an operation that the table does not know, or one that no device
 * answers, is a one-shot. A pulse engine status (0x85/00) whose check byte
 * (params[1]) is 0 gets one of the engine's: leave it 0.
 *
 * Returns the request id 0..255, or -EINVAL (params_len > 4), -EBUSY (window
 * full), -EAGAIN (no id is free: each may still get a late answer, or holds a
 * recent request).
 */
int CreateRequestAsync(pokeys_device_t *dev, pokeys_command_t command, const uint8_t *params,
		       size_t params_len, void *target, size_t target_size);

/* As CreateRequestAsync, with payload (at most 56 bytes, from byte 8; else -EINVAL). */
int CreateRequestAsyncWithPayload(pokeys_device_t *dev, pokeys_command_t command,
				  const uint8_t *params, size_t params_len, const void *payload,
				  size_t payload_size, void *target, size_t target_size);

/*
 * The general form: a complete 64-byte packet as the encoders of wire/ make
 * it (id, checksum and the check byte of a status are filled in here), with
 * callbacks. `refresh` may be NULL: then the same packet is sent again. The
 * class is the caller's. With a parser the entry is freed by itself after the
 * parser ran.
 */
int pokeys_request_create(pokeys_device_t *dev, const uint8_t packet[POKEYS_PACKET_SIZE],
			  enum pokeys_class request_class, pokeys_parser_t parser,
			  pokeys_refresh_t refresh, void *context);

/*
 * Give a created request a deadline of its own for each of its tries (1 ns ..
 * 60 s), for an operation that takes the device long (save to flash, reboot of
 * the engine). It then says nothing about the round trip. Without this a
 * request has what pokeys_device_set_timeout() says. 0, -ENOENT, -EALREADY
 * (sent), -EINVAL.
 */
int pokeys_request_set_deadline(pokeys_device_t *dev, uint8_t request_id, uint64_t deadline_ns);

/*
 * A created request that is asked again and again, so that a newer one takes its place. When
 * its deadline passes, it counts as missed. If it is then the newest of its operation, it is
 * sent again, but only once (a write as its refresh callback has it then). It goes on waiting
 * until deadline_ceiling_ns after it was sent, for its answer may still be the newest there
 * is; or until a newer one of the same operation is answered, or is late as well when another
 * one is sent (in a window of less than 16, as soon as one is sent). Then it ends as
 * POKEYS_REQUEST_CANCELLED. In a full window the oldest gives its place to the next one, late
 * or not. Without an answer its id rests for 100 ms at least, not for the whole
 * reply_lifetime_ns, if no others are free: on a bad link, hundreds of them are unanswered in a
 * second. 0, -ENOENT, -EALREADY (sent), -EINVAL (a one-shot). Realtime safe.
 */
int pokeys_request_set_once(pokeys_device_t *dev, uint8_t request_id);

/*
 * Transmit a created request and stamp it. 0; -ENOENT (no such request),
 * -EALREADY (sent before), -EAGAIN (budget of transmissions used up, try in
 * the next cycle). A transport that refuses the packet is not an error here:
 * the request is in flight, counted send_failed, and retried when its
 * deadline passes; a one-shot that the transport refused was not sent and
 * gives the transport's -errno with the request back in CREATED.
 */
int pokeys_request_send(pokeys_device_t *dev, uint8_t request_id, uint64_t now_ns);

/*
 * Transmit a read or write that is in flight once more, now and not at its deadline, a write
 * with the newest value: for a value that cannot wait for the answer to the one before it. It
 * uses up no retry, takes from the budget of all transmissions and not from that of
 * repetitions, and the deadline counts from now. Which of the two the device executed last is
 * not known. 0; -ENOENT (no such request), -EINVAL (a one-shot is never sent twice), -EALREADY
 * (not in flight: not sent yet, or ended), -EAGAIN (budget used up), -ECANCELED (refresh
 * cancelled it), or the transport's -errno: nothing was sent now, but the deadline counts from
 * now. Realtime safe as far as the transport is.
 */
int pokeys_request_resend(pokeys_device_t *dev, uint8_t request_id, uint64_t now_ns);

/*
 * Take every packet that has arrived, match, copy, complete. Never blocks; at
 * most POKEYS_MAILBOX_SIZE packets a call. Returns the number of requests
 * completed, or the transport's -errno if it fails for good.
 */
int pokeys_device_receive(pokeys_device_t *dev, uint64_t now_ns);

/*
 * For a transport that delivers packets itself (a ring shared by several
 * devices): one datagram. Returns 1 if it completed a request, else 0.
 */
int pokeys_device_deliver(pokeys_device_t *dev, const uint8_t *packet, size_t length,
			  const struct pokeys_rx *rx, uint64_t now_ns);

/*
 * Resend or end every request whose deadline has passed. A resend that the
 * budget refuses uses up a retry and waits for another deadline, so nothing
 * piles up. Returns the number of requests that were resent or ended.
 */
int pokeys_device_check(pokeys_device_t *dev, uint64_t now_ns);

/* Earliest deadline of a request in flight, UINT64_MAX if there is none. */
uint64_t pokeys_device_next_deadline(const pokeys_device_t *dev);

/*
 * Send, receive and check at the current time of CLOCK_MONOTONIC. Errors, time
 * bounds and thread rules are those of the functions called. All are safe in a
 * realtime thread as far as the io functions are.
 */

/* pokeys_request_send(). 0, -ENOENT, -EALREADY, -EAGAIN, or the transport's -errno. */
int SendRequestAsync(pokeys_device_t *dev, uint8_t request_id);

/* pokeys_device_receive(). The number of requests completed, or the transport's -errno. */
int PK_ReceiveAndDispatch(pokeys_device_t *dev);

/*
 * pokeys_device_set_timeout() and pokeys_device_check(): send again, or end
 * when its retries are used up, each read and write whose last transmission is
 * timeout_us old or older.
 *
 * The timeout may differ from call to call, and holds until the next one. It is
 * in microseconds and exact: 0 = the adaptive deadline; more than UINT64_MAX /
 * 1000 = never. However short it is, retries and the two budgets bound what is
 * sent. A one-shot is never sent again: it ends when both the timeout and
 * deadline_ceiling_ns have passed. A request with
 * pokeys_request_set_deadline() keeps its own.
 */
void PK_TimeoutAndRetryCheck(pokeys_device_t *dev, uint64_t timeout_us);

/* How a request stands; POKEYS_REQUEST_FREE for an id without request. */
enum pokeys_request_state pokeys_request_state(const pokeys_device_t *dev, uint8_t request_id);

/* The entry of a request, NULL if there is none. */
const mailbox_entry_t *pokeys_request_get(const pokeys_device_t *dev, uint8_t request_id);

/*
 * End a request that is created or in flight (its late answer is counted, not
 * delivered). 0, or -ENOENT if there is none or it has ended already.
 */
int pokeys_request_cancel(pokeys_device_t *dev, uint8_t request_id, uint64_t now_ns);

/*
 * Give the entry of an ended request back. 0, -ENOENT, or -EBUSY while it is
 * created or in flight (cancel it first). A request with a parser is freed
 * automatically. Freeing the others is optional: when no id is free, the mailbox
 * reuses the entry of an ended request, but not before POKEYS_KEPT_REQUESTS more
 * were created. Until then its state, reply and target can be read.
 */
int pokeys_request_free(pokeys_device_t *dev, uint8_t request_id);

/* A copy of the counters, with in_flight and the round-trip figures of now. */
void pokeys_device_statistics(const pokeys_device_t *dev, struct pokeys_statistics *out);

#ifdef __cplusplus
}
#endif

#endif /* POKEYS_ASYNC_H */
