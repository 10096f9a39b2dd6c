/* SPDX-License-Identifier: MIT */
/*
 * What the Rust crate offers to this room. Nobody else includes it.
 *
 * Cold functions return -errno and upstream's word for it in `error` (which
 * may be NULL); the hot ones (loan, commit, read) make no system call and
 * allocate nothing.
 */
#ifndef SHM_IOX_H
#define SHM_IOX_H

#include <stdint.h>
#include <pokeys/command.h>
#include <pokeys/settings.h>
#include <pokeys/state.h>

struct iox_error {
	char text[64];
};

/*
 * A seat in one root folder. forget: free what a dead one has had in the services that this one
 * has made; `id` is its number, as in the names of its files. is_ours: 1 = it is of this process.
 */
struct iox_node;
int iox_node_open(const char *root, const char *name, struct iox_node **out,
		  struct iox_error *error);
int iox_node_is_ours(const char *id);
int iox_node_forget(const struct iox_node *node, const char *id, struct iox_error *error);
void iox_node_close(struct iox_node *node);

/* A service just created; it lives on as long as a port of it does. */
struct iox_image;
void iox_image_destroy(struct iox_image *image);

/* How many writers the image of this name has; `pid` (or NULL): of the last one seen. */
int iox_writers(const struct iox_node *node, const char *name, int32_t *pid,
		struct iox_error *error);

/*
 * One image each: create (with a first value), and its two ports. read: 1 =
 * *out is a whole image, 0 = never written, -EPROTO = not an image of ours,
 * -EAGAIN = it is written without a pause.
 * writer_open: -EBUSY another writer, -EDEADLK the last one died.
 */
#define IOX_IMAGE(name, type)									\
	struct iox_##name##_writer;								\
	struct iox_##name##_reader;								\
	int iox_##name##_create(const struct iox_node *node, const char *service,		\
				const type *first, struct iox_image **out,			\
				struct iox_error *error);					\
	int iox_##name##_writer_open(const struct iox_node *node, const char *service,		\
				     struct iox_##name##_writer **out,				\
				     struct iox_error *error);					\
	type *iox_##name##_loan(struct iox_##name##_writer *writer);				\
	void iox_##name##_commit(struct iox_##name##_writer *writer);				\
	void iox_##name##_writer_close(struct iox_##name##_writer *writer);			\
	int iox_##name##_reader_open(const struct iox_node *node, const char *service,		\
				     struct iox_##name##_reader **out,				\
				     struct iox_error *error);					\
	int iox_##name##_read(const struct iox_##name##_reader *reader, type *out);		\
	void iox_##name##_reader_close(struct iox_##name##_reader *reader);			\
	uint64_t iox_##name##_hash(void)

IOX_IMAGE(state, struct pokeys_state);
IOX_IMAGE(diag, struct pokeys_diag);
IOX_IMAGE(command, struct pokeys_command);
IOX_IMAGE(report, struct pokeys_report);
IOX_IMAGE(wish, struct pokeys_wish);

/* Like read, but only what was written since the last call (0 = nothing new). */
int iox_wish_news(struct iox_wish_reader *reader, struct pokeys_wish *out);

/* Like read, with one copy less: *out is anything unless 1 is returned. Realtime. */
int iox_state_read_into(const struct iox_state_reader *reader, struct pokeys_state *out);

/* How often they were written. Realtime. */
uint64_t iox_diag_count(const struct iox_diag_reader *reader);
uint64_t iox_report_count(const struct iox_report_reader *reader);

/* For a test of the border: a panic inside becomes -ENOTRECOVERABLE. */
int iox_test_panic(struct iox_error *error);

#endif
